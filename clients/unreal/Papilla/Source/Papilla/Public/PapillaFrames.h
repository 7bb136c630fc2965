// Transforms of Unreal (left-handed, cm) and the finger's frame (right-handed, mm); the arithmetic is papilla/frames.hpp.
#pragma once

#include "CoreMinimal.h"
#include "Kismet/BlueprintFunctionLibrary.h"
#include "PapillaSessionComponent.h"

#include <papilla/frames.hpp>

#include "PapillaFrames.generated.h"

namespace PapillaFrames
{
inline papilla::frames::Place ToPlace(const FTransform& Of)
{
    const FVector At = Of.GetLocation();
    const FQuat Turn = Of.GetRotation();
    return {{At.X, At.Y, At.Z}, {Turn.X, Turn.Y, Turn.Z, Turn.W}};
}

inline FVector ToVector(const papilla::frames::Three& Of, double Factor = 1.0)
{
    return FVector(Factor * Of[0], Factor * Of[1], Factor * Of[2]);
}
}  // namespace PapillaFrames

/** Fingers of tracked hands, what pushes back in the world, the drawn finger. A finger's x points to its tip, its z out of the nail. */
UCLASS()
class PAPILLA_API UPapillaFrames : public UBlueprintFunctionLibrary
{
    GENERATED_BODY()

public:
    /**
     * The finger of two joints of a tracked hand, in the world: that of the distal phalanx (EHandKeypoint::IndexDistal) and the
     * tip (IndexTip). It points from the one to the other, its nail the way of the distal joint's z. The tip's joint is the
     * frame's origin, or lies InsideMm behind it. Left and right hands are the same. False where the joints are no finger.
     */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    static bool FingerOfJoints(const FTransform& Distal, const FTransform& Tip, FTransform& Finger, double InsideMm = 0.0)
    {
        const auto Found = papilla::frames::finger_of_joints(papilla::frames::unreal, PapillaFrames::ToPlace(Distal), PapillaFrames::ToPlace(Tip), InsideMm);
        if (!Found) return false;
        Finger = FTransform(FQuat(Found->turn[0], Found->turn[1], Found->turn[2], Found->turn[3]), PapillaFrames::ToVector(Found->at));
        return true;
    }

    /**
     * What pushes back on the finger, in the world and in Unreal's units: Force for AddForceAtLocation (kg cm/s2, a hundredth of
     * a newton), Torque about the finger's origin for AddTorqueInRadians (kg cm2/s2), Centre of the pressure, cm. An object feels the opposite.
     */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    static bool ToWorld(const FTransform& FingerInWorld, const FPapillaTouch& Touch, FVector& Force, FVector& Torque, FVector& Centre, double WorldScale = 1.0)
    {
        papilla::Touch Of;
        for (int32 Axis = 0; Axis < 3; ++Axis)
        {
            Of.force_n[Axis] = static_cast<float>(Touch.ForceN[Axis]);
            Of.torque_n_mm[Axis] = static_cast<float>(Touch.TorqueNMm[Axis]);
            Of.centre_mm[Axis] = static_cast<float>(Touch.CentreMm[Axis]);
        }
        const auto Felt = papilla::frames::felt(papilla::frames::unreal, PapillaFrames::ToPlace(FingerInWorld), Of, WorldScale);
        if (!Felt) return false;
        Force = PapillaFrames::ToVector(Felt->force_n, 100.0);
        Torque = PapillaFrames::ToVector(Felt->torque_n_m, 10000.0);
        Centre = PapillaFrames::ToVector(Felt->centre);
        return true;
    }

    /** A place of the finger's frame, mm (a vertex of the atlas), in the drawn finger's own axes, cm. Triangles stay as they are. */
    UFUNCTION(BlueprintPure, Category = "Papilla")
    static FVector Drawn(const FVector& AtMm)
    {
        return PapillaFrames::ToVector(papilla::frames::vertex_drawn(papilla::frames::unreal, {AtMm.X, AtMm.Y, AtMm.Z}));
    }
};
