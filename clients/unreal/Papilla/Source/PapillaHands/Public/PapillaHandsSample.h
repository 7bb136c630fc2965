// A scene in one actor: a finger with its map of SED, three objects to touch, and an arrow for the force.
#pragma once

#include "CoreMinimal.h"
#include "GameFramework/Actor.h"
#include "GameFramework/GameModeBase.h"
#include "PapillaDeviceComponent.h"
#include "PapillaSessionComponent.h"

#include "PapillaHandsSample.generated.h"

class UArrowComponent;
class UCameraComponent;
class UProceduralMeshComponent;
class UStaticMesh;
class UStaticMeshComponent;

/**
 * Put it into an empty level and play. The right index finger of a tracked hand touches a ball of rubber, a plate and a bar;
 * without a tracked hand the finger visits them by itself, ten times as large as life, and follows the mouse while its left
 * button is held. It needs a running service.
 */
UCLASS()
class PAPILLAHANDS_API APapillaHandsSample : public AActor
{
    GENERATED_BODY()

public:
    APapillaHandsSample();

    virtual void BeginPlay() override;
    virtual void Tick(float DeltaTime) override;

    /** SED that is drawn in the darkest colour, J/m3. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    float SedOfDarkest = 100.0f;

    /** Length of the arrow for a force of 1 N, mm, as large as life. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    float ArrowMmPerN = 60.0f;

private:
    UFUNCTION()
    void HandleTouched(int32 Finger, const FPapillaTouch& Touch);

    UFUNCTION()
    void HandleLost(int32 Sequence, int32 Finger);

    /** A controller in the right hand feels the size of the force. */
    UFUNCTION()
    void HandleCommand(float Amplitude, float DurationSeconds);

    bool FindTrackedFinger(FTransform& Found) const;
    FTransform FingerOfMouse() const;
    void Arrange(double Scale);
    void DrawFinger(int32 Sequence);
    void Paint(bool bIsFelt);

    UPROPERTY()
    TObjectPtr<UPapillaSessionComponent> Session;
    UPROPERTY()
    TObjectPtr<UPapillaDeviceComponent> Motor;
    UPROPERTY()
    TObjectPtr<UProceduralMeshComponent> Skin;
    UPROPERTY()
    TArray<TObjectPtr<UStaticMeshComponent>> Objects;
    UPROPERTY()
    TObjectPtr<UArrowComponent> Arrow;
    UPROPERTY()
    TObjectPtr<UCameraComponent> Camera;

    /** Where the finger was in the last frames, by their sequences: it is drawn where it was when it felt what comes back. */
    TArray<FTransform> Sent;
    FTransform Finger;
    TArray<FTransform> Places;
    TArray<FVector> Vertices, Moved;
    TArray<int32> Triangles;
    TArray<float> Sed;
    TArray<FLinearColor> Colours;
    double WorldScale = 0.0;
    double Seconds = 0.0;
    bool bWasTracked = false;
};

/** Any level shows the sample with `?game=/Script/PapillaHands.PapillaHandsGameMode` behind its name. */
UCLASS()
class PAPILLAHANDS_API APapillaHandsGameMode : public AGameModeBase
{
    GENERATED_BODY()

public:
    virtual void StartPlay() override;
};
