// A session with a Papilla service, as a component. All protocol logic is in papilla/core.hpp.
#pragma once

#include "Components/ActorComponent.h"
#include "CoreMinimal.h"
#include "PapillaHello.h"

#include <papilla/address.hpp>
#include <papilla/atlas.hpp>
#include <papilla/core.hpp>
#include <papilla/pieces.hpp>

#include "PapillaSessionComponent.generated.h"

class IWebSocket;

/** A contact point: a place on or near the undeformed skin in the finger's frame, a force, a radius. */
USTRUCT(BlueprintType)
struct FPapillaContact
{
    GENERATED_BODY()

    /** mm; x from the tip to the base, y lateral, z towards the nail. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FVector AtMm = FVector::ZeroVector;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double ForceN = 0.0;

    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double RadiusMm = 0.0;  // 0: the finger's own on a flat object
};

/** What pushes back on a finger, in its frame; all of it is in Latest(). */
USTRUCT(BlueprintType)
struct FPapillaTouch
{
    GENERATED_BODY()

    UPROPERTY(BlueprintReadOnly, Category = "Papilla")
    FVector ForceN = FVector::ZeroVector;

    /** About the frame's origin. */
    UPROPERTY(BlueprintReadOnly, Category = "Papilla")
    FVector TorqueNMm = FVector::ZeroVector;

    UPROPERTY(BlueprintReadOnly, Category = "Papilla")
    double AreaMm2 = 0.0;

    /** Centre of the pressure, on the deformed skin. */
    UPROPERTY(BlueprintReadOnly, Category = "Papilla")
    FVector CentreMm = FVector::ZeroVector;

    /** Change of force for a small travel of the objects along it; 0: not asked for. */
    UPROPERTY(BlueprintReadOnly, Category = "Papilla")
    double StiffnessNPerMm = 0.0;
};

DECLARE_DYNAMIC_MULTICAST_DELEGATE(FPapillaReady);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FPapillaRefused, const FString&, Code, const FString&, Message);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FPapillaMapReceived, int32, Sequence, float, SedMaxJPerM3);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FPapillaLost, int32, Sequence, int32, Finger);
DECLARE_DYNAMIC_MULTICAST_DELEGATE_TwoParams(FPapillaTouched, int32, Finger, const FPapillaTouch&, Touch);

/**
 * Sends pressure maps (Pa) or poses of objects and gives the newest strain energy density map (J/m3), 224 x 224 each,
 * and what pushes back.
 * The latest frame wins: sending never blocks or queues. Reconnects by itself, and moves to another connection when the service
 * asks for it. Game thread only.
 */
UCLASS(ClassGroup = (Haptics), meta = (BlueprintSpawnableComponent))
class PAPILLA_API UPapillaSessionComponent : public UActorComponent
{
    GENERATED_BODY()

public:
    UPapillaSessionComponent();

    /** Where the service is: host, host:port, or a URL of http(s) or ws(s). */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FString Server = TEXT("127.0.0.1:7224");

    /** Bearer token, if the service asks for one; blanks around it go. Do not ship it in a package that others can open. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FString Token;

    /** What to ask for. It is said when play begins. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FPapillaHello Hello;

    /** Frames of a finger that may be on their way at once. IWebSocket queues without bound, so this bounds it. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (ClampMin = "1", ClampMax = "8"))
    int32 InFlightMax = 2;

    /**
     * A frame without an answer for so long is lost, s, whether it waits for a connection or for the service; in the second case the
     * connection is given up and another made.
     */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (ClampMin = "0.05"))
    float TimeoutSeconds = 5.0f;

    /** A session is open. */
    UPROPERTY(BlueprintAssignable, Category = "Papilla")
    FPapillaReady OnReady;

    /** The hello was refused, or the service cannot be reached. */
    UPROPERTY(BlueprintAssignable, Category = "Papilla")
    FPapillaRefused OnRefused;

    /** A map came; GetSed reads it. */
    UPROPERTY(BlueprintAssignable, Category = "Papilla")
    FPapillaMapReceived OnMapReceived;

    /** A frame was lost: no answer came in time. Set the actuators to zero. */
    UPROPERTY(BlueprintAssignable, Category = "Papilla")
    FPapillaLost OnLost;

    /** What pushes back on a finger: of poses and gaps. */
    UPROPERTY(BlueprintAssignable, Category = "Papilla")
    FPapillaTouched OnTouched;

    /** Sends a whole map, row by row, Pa; an empty one is no contact. Returns the frame's sequence. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    int32 SendPressure(const TArray<float>& PressurePa);

    /** Sends the pressure of contact points; nothing before the atlas has come (a moment after BeginPlay). */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    int32 SendContacts(const TArray<FPapillaContact>& Contacts);

    /**
     * Sends where the objects of the hello are, all in the world, cm. The finger's x points to its tip, its z out of the
     * nail; its origin is the foremost point of the skin (UPapillaFrames::FingerOfJoints makes it of a tracked hand).
     * WorldScale: how many times as large as life all is drawn. Returns the frame's sequence; 0, and a warning, where a
     * transform is no place.
     */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    int32 SendPoses(const FTransform& FingerInWorld, const TArray<FTransform>& ObjectsInWorld, int32 Finger = 0, double WorldScale = 1.0);

    /** Sends how deep the undeformed skin lies in things, mm, negative in air: at the atlas' vertices, or 224 x 224. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    int32 SendGaps(const TArray<float>& DepthMm, int32 Finger = 0);

    /**
     * Sends that tracking of a finger is lost. Better than an old pose, or one of zeros: the answer is zero, no unit fires, and nothing
     * bursts when tracking comes back. Returns the frame's sequence.
     */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    int32 SendNotTracked(int32 Finger = 0);

    /** The newest firing rates, Hz, 224 x 224; false where the hello does not name the effect "afferents", or none came yet. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    bool GetRatesHz(TArray<float>& RatesHz) const;

    /** The newest answer's map, 224 x 224, J/m3; false if it has none, or none came yet. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    bool GetSed(TArray<float>& SedJPerM3) const;

    /** SED at the atlas' vertices, J/m3, of the newest answer; false if the hello does not ask for it there, or none came yet. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    bool GetSedAtVertices(TArray<float>& SedJPerM3) const;

    /** The finger's skin to draw: its vertices in the drawn finger's own axes, cm, and its triangles; false before the atlas has come. */
    UFUNCTION(BlueprintCallable, Category = "Papilla")
    bool GetSkin(TArray<FVector>& Vertices, TArray<int32>& Triangles) const;

    /** The newest answer with all it carries: summary, points, actuators, times. */
    const papilla::Answer& Latest() const { return Answer; }

    /** Whether a session is open, and what the service agreed to then. */
    bool IsReady() const { return Core && Core->is_ready(); }
    const papilla::json::Value& ReadyMessage() const { return Core->ready().message; }

    /** Sends a window of the map: its samples, Pa, row by row. */
    int32 SendWindow(const float* PressurePa, const papilla::Window& Window, uint32 DeadlineUs = 0);

    virtual void BeginPlay() override;
    virtual void EndPlay(const EEndPlayReason::Type Reason) override;
    virtual void TickComponent(float DeltaTime, ELevelTick Tick, FActorComponentTickFunction* Function) override;

private:
    /** A move to another connection: frames wait while it is Held or Resuming. Paused: it is to be tried again. */
    enum class EMove : uint8 { No, Paused, Dialling, Held, Resuming };

    void Dial(TSharedPtr<IWebSocket>& Dialled);
    void HangUp(TSharedPtr<IWebSocket>& Old);
    void Opened(const IWebSocket* Of);
    void Broke(const IWebSocket* Of);
    void Enter(EMove To);
    void PutOffMove();
    /** Goes on over the old connection: the service did not say what the session remembers. */
    void Stay(const std::string& Why);
    void Resume();
    void Adopt(const FString& Message);
    void TickMove(double Now);
    void HandleText(const FString& Message);
    void HandlePiece(const void* Data, SIZE_T Size, bool bIsLast);
    void Pump();
    void FetchAtlas();
    /** Headers of a request: the token, if there is one. */
    TMap<FString, FString> Headers() const;

    papilla::net::Address Address;
    std::string CleanToken;
    TUniquePtr<papilla::Core> Core;
    TSharedPtr<IWebSocket> Socket, Next;
    papilla::Pieces Pieces;
    papilla::Answer Answer;
    papilla::Atlas Atlas;
    TArray<float> Drawn;
    std::vector<papilla::Contact> Points;
    std::vector<papilla::Pose> Poses;
    bool bHasAtlas = false;
    bool bHasAnswer = false;
    EMove Move = EMove::No;
    double RetryAt = 0.0, MoveUntil = 0.0;
};
