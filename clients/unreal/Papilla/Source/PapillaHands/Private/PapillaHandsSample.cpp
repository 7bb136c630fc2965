#include "PapillaHandsSample.h"

#include "PapillaFrames.h"

#include "Camera/CameraComponent.h"
#include "Components/ArrowComponent.h"
#include "Components/StaticMeshComponent.h"
#include "Engine/StaticMesh.h"
#include "Engine/World.h"
#include "GameFramework/PlayerController.h"
#include "HeadMountedDisplayFunctionLibrary.h"
#include "Materials/MaterialInterface.h"
#include "ProceduralMeshComponent.h"
#include "UObject/ConstructorHelpers.h"

namespace
{
// As large as life. Unreal's axes: x ahead, y right, z up; cm.
constexpr double ScaleOfMouse = 10.0;
constexpr double PitchCm = 3.0;
// Tops of the objects lie here below the actor.
constexpr double TopCm = -1.0;
// The pad: how far behind the foremost point of the skin it presses, and how far below.
constexpr double PadBehindCm = 1.125, PadBelowCm = 0.65;
// Half the heights of ball, plate and bar.
constexpr double HalfCm[] = {1.0, 0.3, 0.3};
// The skin is drawn so much above what it touches, or both surfaces would show through each other.
constexpr double LiftMm = 0.1;
// A power of two.
constexpr int32 SentMax = 256;
const FLinearColor Pale(0.72f, 0.39f, 0.27f), Dark(0.19f, 0.0f, 0.05f);

FPapillaObject Object(EPapillaShapeKind Kind)
{
    FPapillaObject Made;
    Made.Shape.Kind = Kind;
    return Made;
}
}  // namespace

APapillaHandsSample::APapillaHandsSample()
{
    PrimaryActorTick.bCanEverTick = true;
    RootComponent = CreateDefaultSubobject<USceneComponent>(TEXT("Root"));
    Session = CreateDefaultSubobject<UPapillaSessionComponent>(TEXT("Session"));
    Motor = CreateDefaultSubobject<UPapillaDeviceComponent>(TEXT("Motor"));
    Skin = CreateDefaultSubobject<UProceduralMeshComponent>(TEXT("Skin"));
    Skin->SetupAttachment(RootComponent);
    Arrow = CreateDefaultSubobject<UArrowComponent>(TEXT("Force"));
    Arrow->SetupAttachment(RootComponent);
    Arrow->SetHiddenInGame(false);
    Camera = CreateDefaultSubobject<UCameraComponent>(TEXT("Camera"));
    Camera->SetupAttachment(RootComponent);
    static ConstructorHelpers::FObjectFinder<UStaticMesh> Ball(TEXT("/Engine/BasicShapes/Sphere.Sphere"));
    static ConstructorHelpers::FObjectFinder<UStaticMesh> Cube(TEXT("/Engine/BasicShapes/Cube.Cube"));
    static ConstructorHelpers::FObjectFinder<UStaticMesh> Bar(TEXT("/Engine/BasicShapes/Cylinder.Cylinder"));
    static ConstructorHelpers::FObjectFinder<UMaterialInterface> Painted(TEXT("/Engine/EngineDebugMaterials/VertexColorMaterial.VertexColorMaterial"));
    UStaticMesh* const Meshes[] = {Ball.Object, Cube.Object, Bar.Object};
    const TCHAR* const Names[] = {TEXT("Ball"), TEXT("Plate"), TEXT("Bar")};
    for (int32 At = 0; At < 3; ++At)
    {
        UStaticMeshComponent* const Made = CreateDefaultSubobject<UStaticMeshComponent>(Names[At]);
        Made->SetupAttachment(RootComponent);
        Made->SetStaticMesh(Meshes[At]);
        Objects.Add(Made);
    }
    Skin->SetMaterial(0, Painted.Object);

    // What the three are: a ball of 10 mm radius that gives way and sticks, a plate and a bar that do neither.
    FPapillaObject Rubber = Object(EPapillaShapeKind::Sphere);
    Rubber.Shape.SphereRadiusMm = 10.0;
    Rubber.Material.StiffnessMpaPerMm = 0.05;
    Rubber.Material.Friction = 0.5;
    Session->Hello.Objects = {Rubber, Object(EPapillaShapeKind::Plate), Object(EPapillaShapeKind::Cylinder)};
    Session->Hello.AnswerLayout = EPapillaSampleLayout::Vertices;
    Session->Hello.bUseShearEnergy = true;
    Session->Hello.bDisplacement = true;
}

void APapillaHandsSample::BeginPlay()
{
    Super::BeginPlay();
    Session->OnTouched.AddDynamic(this, &APapillaHandsSample::HandleTouched);
    Session->OnLost.AddDynamic(this, &APapillaHandsSample::HandleLost);
    Motor->OnCommand.AddDynamic(this, &APapillaHandsSample::HandleCommand);
    if (APlayerController* const Player = GetWorld()->GetFirstPlayerController()) Player->SetViewTarget(this);
}

void APapillaHandsSample::Tick(float DeltaTime)
{
    Super::Tick(DeltaTime);
    Seconds += DeltaTime;
    FTransform Tracked;
    const bool bIsTracked = FindTrackedFinger(Tracked);
    bWasTracked = bWasTracked || bIsTracked;
    if (bWasTracked && !bIsTracked)
    {
        // A hand that was there and is lost is told as that: nothing is felt until it is back.
        Session->SendNotTracked();
        Arrow->SetVisibility(false);
        Paint(false);
        return;
    }
    Arrange(bIsTracked ? 1.0 : ScaleOfMouse);
    const FTransform Now = bIsTracked ? Tracked : FingerOfMouse();
    const int32 Sequence = Session->SendPoses(Now, Places, 0, WorldScale);
    Sent.SetNum(SentMax);
    Sent[Sequence & (SentMax - 1)] = Now;
    if (Vertices.IsEmpty() && Session->GetSkin(Vertices, Triangles))
    {
        // Both sides: the skin is open towards the nail, and from above one sees its inside.
        for (int32 At = Triangles.Num() - 1; At >= 0; --At)
        {
            const int32 Corner = Triangles[At];
            Triangles.Add(Corner);
        }
        Colours.Init(Pale, Vertices.Num());
        Skin->CreateMeshSection_LinearColor(0, Vertices, Triangles, {}, {}, Colours, {}, false);
    }
}

bool APapillaHandsSample::FindTrackedFinger(FTransform& Found) const
{
    FXRMotionControllerData Hand;
    UHeadMountedDisplayFunctionLibrary::GetMotionControllerData(const_cast<APapillaHandsSample*>(this), EControllerHand::Right, Hand);
    const int32 Distal = static_cast<int32>(EHandKeypoint::IndexDistal), Tip = static_cast<int32>(EHandKeypoint::IndexTip);
    if (!Hand.bValid || !Hand.HandKeyPositions.IsValidIndex(Tip) || !Hand.HandKeyRotations.IsValidIndex(Tip)) return false;
    return UPapillaFrames::FingerOfJoints(
        FTransform(Hand.HandKeyRotations[Distal], Hand.HandKeyPositions[Distal]), FTransform(Hand.HandKeyRotations[Tip], Hand.HandKeyPositions[Tip]), Found);
}

FTransform APapillaHandsSample::FingerOfMouse() const
{
    // From object to object in two seconds each, down by 1 mm into it and up again.
    const double Turn = Seconds / 2.0;
    double AsideCm = PitchCm * (static_cast<int32>(Turn) % 3 - 1);
    double DepthCm = 0.3 * FMath::Sin(6.2831853 * Turn - 1.5707963) - 0.2;
    const APlayerController* const Player = GetWorld()->GetFirstPlayerController();
    float X = 0.0f, Y = 0.0f;
    int32 Width = 0, Height = 0;
    if (Player && Player->IsInputKeyDown(EKeys::LeftMouseButton) && Player->GetMousePosition(X, Y))
    {
        Player->GetViewportSize(Width, Height);
        AsideCm = 3.0 * PitchCm * (X / FMath::Max(Width, 1) - 0.5);
        DepthCm = 0.1 - 0.8 * (0.5 - Y / FMath::Max(Height, 1));
    }
    const FVector Aside(PadBehindCm, AsideCm, TopCm + PadBelowCm - FMath::Clamp(DepthCm, -1.0, 0.15));
    return FTransform(FRotator::ZeroRotator, GetActorLocation() + Aside * WorldScale);
}

void APapillaHandsSample::Arrange(double Scale)
{
    if (Scale == WorldScale) return;
    WorldScale = Scale;
    const FVector SizesCm[] = {FVector(2.0, 2.0, 2.0), FVector(2.0, 2.0, 0.6), FVector(0.6, 0.6, 3.0)};
    Places.Reset();
    for (int32 At = 0; At < 3; ++At)
    {
        const FVector Where = GetActorLocation() + FVector(0.0, PitchCm * (At - 1), TopCm - HalfCm[At]) * Scale;
        Places.Add(FTransform(FRotator::ZeroRotator, Where));
        // Unreal's cylinder stands; the bar lies along y. The basic shapes measure 100 cm.
        Objects[At]->SetWorldTransform(FTransform(At == 2 ? FRotator(0.0, 0.0, 90.0) : FRotator::ZeroRotator, Where));
        Objects[At]->SetWorldScale3D(SizesCm[At] * (0.01 * Scale));
    }
    Camera->SetWorldTransform(FTransform(FRotator(-25.0, 0.0, 0.0), GetActorLocation() + FVector(-12.0, 0.0, 5.0) * Scale));
}

void APapillaHandsSample::HandleTouched(int32, const FPapillaTouch& Touch)
{
    if (Session->Latest().not_tracked) return;
    DrawFinger(static_cast<int32>(Session->Latest().sequence));
    FVector Force, Torque, Centre;
    if (!UPapillaFrames::ToWorld(Finger, Touch, Force, Torque, Centre, WorldScale)) return;
    // 100 of Unreal's units are 1 N; the arrow is 80 cm long as it comes.
    const double LengthCm = 0.1 * ArrowMmPerN * Force.Size() / 100.0 * WorldScale;
    Arrow->SetVisibility(LengthCm > 0.0);
    Arrow->SetWorldTransform(FTransform(Force.Rotation(), Centre));
    Arrow->SetWorldScale3D(FVector::OneVector * (LengthCm / 80.0));
    Paint(true);
}

void APapillaHandsSample::HandleLost(int32 Sequence, int32)
{
    DrawFinger(Sequence);
    // Nothing is known of the touch any more: nothing is shown, and actuators would go to zero.
    Arrow->SetVisibility(false);
    Paint(false);
}

void APapillaHandsSample::HandleCommand(float Amplitude, float)
{
    // Unreal holds a value until the next one; the last command is one of 0.
    if (APlayerController* const Player = GetWorld()->GetFirstPlayerController()) Player->SetHapticsByValue(1.0f, Amplitude, EControllerHand::Right);
}

void APapillaHandsSample::DrawFinger(int32 Sequence)
{
    if (Sent.IsEmpty()) return;
    Finger = Sent[Sequence & (SentMax - 1)];
    Skin->SetWorldTransform(Finger);
    Skin->SetWorldScale3D(FVector::OneVector * WorldScale);
}

void APapillaHandsSample::Paint(bool bIsFelt)
{
    if (Vertices.IsEmpty()) return;
    const bool bHasSed = bIsFelt && Session->GetSedAtVertices(Sed) && Sed.Num() == Vertices.Num();
    for (int32 At = 0; At < Vertices.Num(); ++At)
    {
        const float Share = bHasSed ? FMath::Clamp(Sed[At] / SedOfDarkest, 0.0f, 1.0f) : 0.0f;
        Colours[At] = FLinearColor(Pale.R + Share * (Dark.R - Pale.R), Pale.G + Share * (Dark.G - Pale.G), Pale.B + Share * (Dark.B - Pale.B));
    }
    const std::vector<float>& MovedMm = Session->Latest().displacement_mm;
    const bool bMoves = bHasSed && MovedMm.size() == 3 * static_cast<size_t>(Vertices.Num());
    Moved = Vertices;
    for (int32 At = 0; bMoves && At < Moved.Num(); ++At)
    {
        Moved[At] = Moved[At] + UPapillaFrames::Drawn(FVector(MovedMm[3 * At], MovedMm[3 * At + 1], MovedMm[3 * At + 2] + LiftMm));
    }
    Skin->UpdateMeshSection_LinearColor(0, Moved, {}, {}, Colours, {});
}

void APapillaHandsGameMode::StartPlay()
{
    Super::StartPlay();
    GetWorld()->SpawnActor<APapillaHandsSample>();
}
