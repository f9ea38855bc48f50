// Unreal's types to the core's, and back. The arithmetic is in core/axes.h.

#pragma once

#include "CoreMinimal.h"
#include "core/axes.h"

namespace WadeAxes
{
	inline wade::Vec3 Plain(const FVector& V) { return {V.X, V.Y, V.Z}; }
	inline FVector Unreal(const wade::Vec3& V) { return FVector(V.x, V.y, V.z); }
	inline wade::Quat Rotation(const FQuat& Q) { return wade::axes::rotation({Q.W, Q.X, Q.Y, Q.Z}); }
	/** A point or a velocity in cm, of the world or a body. */
	inline wade::Vec3 FromUnreal(const FVector& V) { return wade::axes::from_unreal(Plain(V)); }
	inline FVector ToUnreal(const wade::Vec3& V) { return Unreal(wade::axes::to_unreal(V)); }
}
