// What a haptic device takes of a session, as a component beside it. All of it is in papilla/device.hpp.
#pragma once

#include "Components/ActorComponent.h"
#include "CoreMinimal.h"
#include "PapillaSessionComponent.h"

#include <papilla/device.hpp>

#include "PapillaDeviceComponent.generated.h"

/** What a device follows. */
UENUM(BlueprintType)
enum class EPapillaDeviceSource : uint8
{
    /** The size of the force on the finger; of pressure maps the effect "summary" has it. */
    Force,
    /** An intensity for each actuator of the effect "actuators". */
    Actuators,
    /** The mean firing rate of the rapidly adapting and Pacinian units of the effect "spikes"; most lie outside of a contact: a few Hz are much. */
    Spikes,
};

DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FPapillaDeviceCommand, float, Amplitude, float, DurationSeconds);

/**
 * Put it on the actor that has the Papilla Session. It turns answers into intensities from 0 to 1, at most MaxHz times a second, and
 * falls to 0 when answers stop, whatever the reason. OnCommand is for your driver; for a controller call Set Haptics By Value.
 */
UCLASS(ClassGroup = (Haptics), meta = (BlueprintSpawnableComponent))
class PAPILLA_API UPapillaDeviceComponent : public UActorComponent
{
    GENERATED_BODY()

public:
    UPapillaDeviceComponent();

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaDeviceSource Source = EPapillaDeviceSource::Force;

    /** What intensity 1 stands for: N, the "max" of actuators, or Hz. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    float Full = 1.0f;

    /** A force up to here is not felt, N. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (ClampMin = "0"))
    float ThresholdN = 0.0f;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (ClampMin = "1", ClampMax = "10"))
    int32 Fingers = 1;

    /** Commands a second that the device takes. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    float MaxHz = 90.0f;

    /** What an answer said is held for so long, and then fades to 0 within FadeSeconds. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    float HoldSeconds = 0.05f;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    float FadeSeconds = 0.05f;

    /** A command is due: its greatest intensity, and how long the device may hold it. */
    UPROPERTY(BlueprintAssignable, Category = "Papilla")
    FPapillaDeviceCommand OnCommand;

    /** The intensities of a finger's actuators in the last command; false where there is no such finger. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    bool GetLevels(int32 Finger, TArray<float>& Levels) const;

    virtual void BeginPlay() override;
    virtual void EndPlay(const EEndPlayReason::Type Reason) override;
    virtual void TickComponent(float DeltaTime, ELevelTick Tick, FActorComponentTickFunction* Function) override;

private:
    UFUNCTION()
    void HandleTouched(int32 Finger, const FPapillaTouch& Touch);

    UFUNCTION()
    void HandleMap(int32 Sequence, float SedMaxJPerM3);

    /** Units are the session's: where spikes are followed, the device begins anew with each Ready. */
    UFUNCTION()
    void HandleReady();

    bool Make();
    void Feed();
    void Send(const papilla::DeviceCommand& Command);

    UPROPERTY()
    TObjectPtr<UPapillaSessionComponent> Session;

    TUniquePtr<papilla::Device> Device;
    papilla::DeviceCommand Last;
};
