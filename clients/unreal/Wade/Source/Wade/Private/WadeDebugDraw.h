// Arrows for the forces and a patch of the water plane.

#pragma once

#include "CoreMinimal.h"

class UWorld;
struct FWadeReport;

/** For one frame; `Scale` in cm/N. */
void DrawWadeForces(const UWorld* World, const FWadeReport& Report, float Scale);
