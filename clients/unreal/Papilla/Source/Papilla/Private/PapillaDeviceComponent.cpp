#include "PapillaDeviceComponent.h"

#include "GameFramework/Actor.h"

UPapillaDeviceComponent::UPapillaDeviceComponent()
{
    PrimaryComponentTick.bCanEverTick = true;
}

void UPapillaDeviceComponent::BeginPlay()
{
    Super::BeginPlay();
    Session = GetOwner()->FindComponentByClass<UPapillaSessionComponent>();
    if (!Session)
    {
        UE_LOG(LogTemp, Error, TEXT("Papilla: a device needs a Papilla Session on the same actor"));
        return;
    }
    if (Source == EPapillaDeviceSource::Spikes)
    {
        Session->OnReady.AddDynamic(this, &UPapillaDeviceComponent::HandleReady);
        if (Session->IsReady()) HandleReady();
    }
    else if (!Make())
    {
        return;
    }
    Session->OnTouched.AddDynamic(this, &UPapillaDeviceComponent::HandleTouched);
    Session->OnMapReceived.AddDynamic(this, &UPapillaDeviceComponent::HandleMap);
}

bool UPapillaDeviceComponent::Make()
{
    papilla::Device::Options Options;
    Options.fingers = static_cast<size_t>(FMath::Max(Fingers, 1));
    Options.max_hz = MaxHz;
    Options.hold_s = HoldSeconds;
    Options.fade_s = FadeSeconds;
    Options.clock_s = [] { return FPlatformTime::Seconds(); };
    try
    {
        const papilla::ReadLevels Read = Source == EPapillaDeviceSource::Force ? papilla::device_force(Full, ThresholdN)
            : Source == EPapillaDeviceSource::Actuators ? papilla::device_actuators(Full)
                                                        : papilla::device_spike_rate(Session->ReadyMessage()["units"], Full);
        Device = MakeUnique<papilla::Device>(Read, Options);
    }
    catch (const std::logic_error& Error)
    {
        UE_LOG(LogTemp, Error, TEXT("Papilla: no device: %s"), UTF8_TO_TCHAR(Error.what()));
        Device = nullptr;
    }
    return Device != nullptr;
}

void UPapillaDeviceComponent::HandleReady()
{
    if (Device) Send(Device->stop());
    Make();
}

void UPapillaDeviceComponent::EndPlay(const EEndPlayReason::Type Reason)
{
    if (Device) Send(Device->stop());
    Super::EndPlay(Reason);
}

void UPapillaDeviceComponent::TickComponent(float DeltaTime, ELevelTick Tick, FActorComponentTickFunction* Function)
{
    Super::TickComponent(DeltaTime, Tick, Function);
    if (!Device) return;
    if (const std::optional<papilla::DeviceCommand> Command = Device->poll()) Send(*Command);
}

bool UPapillaDeviceComponent::GetLevels(int32 Finger, TArray<float>& Levels) const
{
    Levels.Reset();
    if (Finger < 0 || static_cast<size_t>(Finger) >= Last.levels.size()) return false;
    for (const float Level : Last.levels[Finger]) Levels.Add(Level);
    return true;
}

void UPapillaDeviceComponent::HandleTouched(int32, const FPapillaTouch&)
{
    Feed();
}

void UPapillaDeviceComponent::HandleMap(int32, float)
{
    // A touch with a map comes once.
    if (!Session->Latest().has_touch) Feed();
}

void UPapillaDeviceComponent::Feed()
{
    if (!Device) return;
    try
    {
        Device->feed(Session->Latest());
    }
    catch (const std::logic_error& Error)
    {
        // Of another finger, or without what the device follows: it fades.
        UE_LOG(LogTemp, Warning, TEXT("Papilla: device: %s"), UTF8_TO_TCHAR(Error.what()));
    }
}

void UPapillaDeviceComponent::Send(const papilla::DeviceCommand& Command)
{
    Last = Command;
    OnCommand.Broadcast(Command.amplitude, static_cast<float>(Command.duration_s));
}
