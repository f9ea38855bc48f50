#include "WadeDebugDraw.h"

#include "DrawDebugHelpers.h"
#include "Engine/World.h"
#include "WadeSimCallback.h"

void DrawWadeForces(const UWorld* World, const FWadeReport& Report, float Scale)
{
#if ENABLE_DRAW_DEBUG
	constexpr float Head = 8.0f;
	constexpr float Thickness = 1.5f;
	constexpr float PlaneSize = 150.0f;
	const auto Arrow = [World, Scale](const FVector& From, const FVector& Force, const FColor& Color)
	{
		DrawDebugDirectionalArrow(World, From, From + Scale * Force, Head, Color, false, -1.0f, 0, Thickness);
	};
	for (int32 Surface = 0; Surface < Report.SurfacePoints.Num(); ++Surface)
	{
		Arrow(Report.SurfacePoints[Surface], Report.SurfaceForces[Surface], FColor::Cyan);
	}
	Arrow(Report.Place, Report.Force, FColor::Yellow);
	if (Report.bWater)
	{
		const FPlane Plane(Report.WaterPoint, Report.WaterNormal);
		DrawDebugSolidPlane(World, Plane, Report.Place, PlaneSize, FColor(40, 90, 200, 60), false, -1.0f, 0);
	}
	const FString Text = FString::Printf(TEXT("%.0f cm  %.0f N"), Report.DepthCm, Report.Force.Size());
	// red where the server has to guess
	const FColor Color = Report.DepthOutsideCm == 0.0 ? FColor::White : FColor::Red;
	DrawDebugString(World, Report.Place, Text, nullptr, Color, 0.0f);
#endif
}
