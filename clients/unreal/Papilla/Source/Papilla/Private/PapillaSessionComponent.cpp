#include "PapillaSessionComponent.h"

#include "PapillaFrames.h"

#include "HttpModule.h"
#include "IWebSocket.h"
#include "Interfaces/IHttpRequest.h"
#include "Interfaces/IHttpResponse.h"
#include "Modules/ModuleManager.h"
#include "WebSocketsModule.h"

namespace
{
constexpr double RetrySeconds = 0.15;
constexpr double MovePatienceSeconds = 5.0;

FString ToFString(const std::string& Text)
{
    return FString(UTF8_TO_TCHAR(Text.c_str()));
}

std::string ToUtf8(const FString& Text)
{
    return std::string(TCHAR_TO_UTF8(*Text));
}

FVector ToFVector(const std::array<float, 3>& Three)
{
    return FVector(Three[0], Three[1], Three[2]);
}

FPapillaTouch ToTouch(const papilla::Touch& From)
{
    FPapillaTouch Touch;
    Touch.ForceN = ToFVector(From.force_n);
    Touch.TorqueNMm = ToFVector(From.torque_n_mm);
    Touch.AreaMm2 = From.area_mm2;
    Touch.CentreMm = ToFVector(From.centre_mm);
    Touch.StiffnessNPerMm = From.stiffness_n_per_mm;
    return Touch;
}

uint64 NowUs()
{
    return static_cast<uint64>(FPlatformTime::Seconds() * 1e6);
}
/** Whether a session can have such a finger; if not, the log says so. */
bool IsFinger(int32 Finger)
{
    constexpr int32 FingersMax = 10;
    const bool bIsGood = Finger >= 0 && Finger < FingersMax;
    if (!bIsGood) UE_LOG(LogTemp, Error, TEXT("Papilla: there is no finger %d; a session has %d at most"), Finger, FingersMax);
    return bIsGood;
}
}  // namespace

UPapillaSessionComponent::UPapillaSessionComponent()
{
    PrimaryComponentTick.bCanEverTick = true;
}

void UPapillaSessionComponent::BeginPlay()
{
    Super::BeginPlay();
    Drawn.SetNumZeroed(static_cast<int32>(papilla::map_len));
    papilla::Problem Problem;
    Address = papilla::net::Address::of(ToUtf8(Server));
    const std::string Members = Hello.ToCore().members();
    bool bIsGood = papilla::Core::is_readable(Members, Problem);
    if (!Address.fault.empty())
    {
        Problem = {"bad_address", Address.fault, "Server"};
        bIsGood = false;
    }
    CleanToken = ToUtf8(Token);
    if (!papilla::net::clean_token(CleanToken))
    {
        Problem = {"bad_token", "the token holds a blank, a line end or a character that no token has", "Token"};
        bIsGood = false;
    }
    if (!bIsGood)
    {
        UE_LOG(LogTemp, Error, TEXT("Papilla: %s"), *ToFString(Problem.message));
        OnRefused.Broadcast(ToFString(Problem.code), ToFString(Problem.message));
        return;
    }
    Core = MakeUnique<papilla::Core>(papilla::Core::following(Members));
    Core->on_warning = [](const std::string& Words)
    {
        UE_LOG(LogTemp, Warning, TEXT("Papilla: %s"), *ToFString(Words));
    };
    Core->on_answer = [this](const papilla::Answer& Outcome)
    {
        if (Outcome.status == papilla::Status::lost) OnLost.Broadcast(static_cast<int32>(Outcome.sequence), Outcome.finger);
        if (Outcome.status != papilla::Status::ok) return;
        Answer = Outcome;
        bHasAnswer = true;
        if (Outcome.has_map) OnMapReceived.Broadcast(static_cast<int32>(Outcome.sequence), Outcome.max());
        if (Outcome.has_touch) OnTouched.Broadcast(Outcome.finger, ToTouch(Outcome.touch));
    };
    FetchAtlas();
    Dial(Socket);
}

void UPapillaSessionComponent::EndPlay(const EEndPlayReason::Type Reason)
{
    if (Core) Core->on_answer = nullptr;
    HangUp(Socket);
    HangUp(Next);
    Super::EndPlay(Reason);
}

void UPapillaSessionComponent::HangUp(TSharedPtr<IWebSocket>& Old)
{
    if (!Old) return;
    Old->OnConnected().Clear();
    Old->OnConnectionError().Clear();
    Old->OnClosed().Clear();
    Old->OnMessage().Clear();
    Old->OnBinaryMessage().Clear();
    Old->Close();
    Old.Reset();
}

void UPapillaSessionComponent::Dial(TSharedPtr<IWebSocket>& Dialled)
{
    HangUp(Dialled);
    FWebSocketsModule& Module = FModuleManager::LoadModuleChecked<FWebSocketsModule>(TEXT("WebSockets"));
    Dialled = Module.CreateWebSocket(ToFString(Address.session()), FString(), Headers());
    // Told apart by address alone: which of the two it is changes when the session moves.
    IWebSocket* const Of = Dialled.Get();
    TWeakObjectPtr<UPapillaSessionComponent> Weak(this);
    Dialled->OnConnected().AddLambda([Weak, Of]()
    {
        if (UPapillaSessionComponent* Self = Weak.Get()) Self->Opened(Of);
    });
    Dialled->OnConnectionError().AddLambda([Weak, Of](const FString& Error)
    {
        UPapillaSessionComponent* const Self = Weak.Get();
        if (!Self) return;
        if (Of == Self->Socket.Get()) Self->OnRefused.Broadcast(FString(), Error);
        Self->Broke(Of);
    });
    Dialled->OnClosed().AddLambda([Weak, Of](int32, const FString&, bool)
    {
        if (UPapillaSessionComponent* Self = Weak.Get()) Self->Broke(Of);
    });
    Dialled->OnMessage().AddLambda([Weak, Of](const FString& Message)
    {
        UPapillaSessionComponent* const Self = Weak.Get();
        if (!Self) return;
        if (Of == Self->Next.Get()) Self->Adopt(Message);
        else if (Of == Self->Socket.Get()) Self->HandleText(Message);
    });
    Dialled->OnBinaryMessage().AddLambda([Weak, Of](const void* Data, SIZE_T Size, bool bIsLast)
    {
        UPapillaSessionComponent* const Self = Weak.Get();
        if (Self && Of == Self->Socket.Get()) Self->HandlePiece(Data, Size, bIsLast);
    });
    Dialled->Connect();
}

void UPapillaSessionComponent::Opened(const IWebSocket* Of)
{
    if (Of == Socket.Get()) Socket->Send(ToFString(Core->hello()));
    if (Of != Next.Get() || Move != EMove::Dialling) return;
    // Nothing leaves from now on: the answers to what has left come before the sealed state.
    Socket->Send(ToFString(Core->ask_for_seal()));
    Enter(EMove::Held);
}

void UPapillaSessionComponent::Broke(const IWebSocket* Of)
{
    if (Of == Next.Get()) PutOffMove();
    if (Of != Socket.Get()) return;
    Core->lost();
    Pieces.reset();
    Move = EMove::No;
    // New sockets at the next tick after that: not from within the old one's call.
    RetryAt = FPlatformTime::Seconds() + RetrySeconds;
}

void UPapillaSessionComponent::Enter(EMove To)
{
    Move = To;
    MoveUntil = FPlatformTime::Seconds() + MovePatienceSeconds;
}

void UPapillaSessionComponent::PutOffMove()
{
    // The old connection goes on for as long as it is there.
    if (Move == EMove::No) return;
    Move = EMove::Paused;
    MoveUntil = FPlatformTime::Seconds() + RetrySeconds;
}

void UPapillaSessionComponent::Resume()
{
    if (!Core->is_last_seal() || Move != EMove::Held) return;
    Next->Send(ToFString(Core->resuming()));
    Next->Send(Pieces.message().data(), Pieces.message().size(), true);
    Enter(EMove::Resuming);
}

void UPapillaSessionComponent::Adopt(const FString& Message)
{
    if (Move != EMove::Resuming) return;
    if (Core->text(ToUtf8(Message)) != papilla::Core::Event::ready)
    {
        PutOffMove();
        return;
    }
    Swap(Socket, Next);
    HangUp(Next);
    Pieces.reset();
    Move = EMove::No;
    OnReady.Broadcast();
    Pump();
}

void UPapillaSessionComponent::TickMove(double Now)
{
    if (Move == EMove::No)
    {
        HangUp(Next);
        return;
    }
    if (Now < MoveUntil) return;
    if (Move == EMove::Paused)
    {
        Enter(EMove::Dialling);
        Dial(Next);
        return;
    }
    if (Move == EMove::Held)
    {
        Stay("nothing came in time");
        return;
    }
    HangUp(Next);
    PutOffMove();
}

void UPapillaSessionComponent::Stay(const std::string& Why)
{
    Core->stay(Why);
    Move = EMove::No;
    HangUp(Next);
    Pump();
}

void UPapillaSessionComponent::HandleText(const FString& Message)
{
    switch (Core->text(ToUtf8(Message)))
    {
    case papilla::Core::Event::ready:
        OnReady.Broadcast();
        Pump();
        break;
    case papilla::Core::Event::refused:
        if (Move == EMove::Held)
        {
            // In place of the seal: nothing else is asked for meanwhile.
            if (Core->is_last_seal()) Stay(Core->refusal().message);
            break;
        }
        OnRefused.Broadcast(ToFString(Core->refusal().code), ToFString(Core->refusal().message));
        break;
    case papilla::Core::Event::broken:
        Socket->Close();
        break;
    case papilla::Core::Event::reconnect:
        // Dials at the next tick.
        if (Move == EMove::No) Move = EMove::Paused, MoveUntil = 0.0;
        break;
    case papilla::Core::Event::nothing:
        Pump();
        break;
    }
}

void UPapillaSessionComponent::HandlePiece(const void* Data, SIZE_T Size, bool bIsLast)
{
    // Unreal hands over 64 KiB at a time: a frame of f32 comes in four pieces.
    if (!Pieces.add(Data, Size, bIsLast)) return;
    if (papilla::Core::is_sealed(Pieces.message().data(), Pieces.message().size()))
    {
        Resume();
        return;
    }
    if (Core->binary(Pieces.message().data(), Pieces.message().size()) == papilla::Core::Event::broken)
    {
        Socket->Close();
        return;
    }
    Pump();
}

void UPapillaSessionComponent::Pump()
{
    // The service has a place for each finger.
    const size_t Most = static_cast<size_t>(InFlightMax) * Core->fingers();
    const bool bIsHeld = Move == EMove::Held || Move == EMove::Resuming;
    while (Socket && !bIsHeld && Core->in_flight() < Most)
    {
        papilla::Outgoing* const Frame = Core->take();
        if (!Frame) return;
        Socket->Send(Frame->data(), Frame->size, true);
    }
}

void UPapillaSessionComponent::TickComponent(float DeltaTime, ELevelTick Tick, FActorComponentTickFunction* Function)
{
    Super::TickComponent(DeltaTime, Tick, Function);
    if (!Core) return;
    const double Now = FPlatformTime::Seconds();
    // A service that stopped, or a network that is gone: nothing more will come of this connection.
    if (Core->expire(static_cast<uint64>(FMath::Max(TimeoutSeconds, 0.001f) * 1e6)) && Socket)
    {
        HangUp(Socket);
        Broke(Socket.Get());
    }
    TickMove(Now);
    if (RetryAt > 0.0 && Now >= RetryAt)
    {
        RetryAt = 0.0;
        if (!bHasAtlas) FetchAtlas();
        Dial(Socket);
    }
    Pump();
}

int32 UPapillaSessionComponent::SendWindow(const float* PressurePa, const papilla::Window& Window, uint32 DeadlineUs)
{
    if (!Core) return 0;
    const int32 Sequence = static_cast<int32>(Core->send(PressurePa, Window, NowUs(), DeadlineUs));
    Pump();
    return Sequence;
}

int32 UPapillaSessionComponent::SendPressure(const TArray<float>& PressurePa)
{
    if (PressurePa.IsEmpty()) return SendWindow(nullptr, {});
    if (PressurePa.Num() != static_cast<int32>(papilla::map_len))
    {
        OnRefused.Broadcast(TEXT("wrong_length"), TEXT("a pressure map has 224 x 224 samples"));
        return 0;
    }
    return SendWindow(PressurePa.GetData(), {});
}

int32 UPapillaSessionComponent::SendContacts(const TArray<FPapillaContact>& Contacts)
{
    if (!bHasAtlas) return 0;
    Points.clear();
    for (const FPapillaContact& Contact : Contacts)
    {
        Points.push_back({{Contact.AtMm.X, Contact.AtMm.Y, Contact.AtMm.Z}, Contact.ForceN, Contact.RadiusMm});
    }
    Atlas.contacts(Points.data(), Points.size(), Drawn.GetData());
    return SendWindow(Drawn.GetData(), {});
}

int32 UPapillaSessionComponent::SendPoses(const FTransform& FingerInWorld, const TArray<FTransform>& ObjectsInWorld, int32 Finger, double WorldScale)
{
    if (!Core || !IsFinger(Finger)) return 0;
    Poses.clear();
    const papilla::frames::Place Hand = PapillaFrames::ToPlace(FingerInWorld);
    for (const FTransform& Object : ObjectsInWorld)
    {
        const std::optional<papilla::Pose> Pose = papilla::frames::to_finger(papilla::frames::unreal, Hand, PapillaFrames::ToPlace(Object), WorldScale);
        if (!Pose)
        {
            UE_LOG(LogTemp, Warning, TEXT("Papilla: a transform is not finite or WorldScale not above 0; while the hand is not tracked call SendNotTracked"));
            return 0;
        }
        Poses.push_back(*Pose);
    }
    const uint32 Sequence = Core->send_poses(Poses.data(), Poses.size(), NowUs(), static_cast<uint8>(Finger));
    Pump();
    return static_cast<int32>(Sequence);
}

int32 UPapillaSessionComponent::SendGaps(const TArray<float>& DepthMm, int32 Finger)
{
    if (!Core || !IsFinger(Finger)) return 0;
    const auto Count = static_cast<size_t>(DepthMm.Num());
    const uint32 Sequence = Core->send_gaps(DepthMm.GetData(), Count, NowUs(), static_cast<uint8>(Finger));
    Pump();
    return static_cast<int32>(Sequence);
}

int32 UPapillaSessionComponent::SendNotTracked(int32 Finger)
{
    if (!Core || !IsFinger(Finger)) return 0;
    const uint32 Sequence = Core->send_not_tracked(NowUs(), static_cast<uint8>(Finger));
    Pump();
    return static_cast<int32>(Sequence);
}

bool UPapillaSessionComponent::GetRatesHz(TArray<float>& RatesHz) const
{
    RatesHz.SetNumZeroed(static_cast<int32>(papilla::map_len));
    if (!bHasAnswer || Answer.rates_hz.size() != papilla::map_len) return false;
    FMemory::Memcpy(RatesHz.GetData(), Answer.rates_hz.data(), papilla::map_len * sizeof(float));
    return true;
}

bool UPapillaSessionComponent::GetSed(TArray<float>& SedJPerM3) const
{
    SedJPerM3.SetNumZeroed(static_cast<int32>(papilla::map_len));
    if (!bHasAnswer || !Answer.has_map) return false;
    for (int32 Row = 0; Row < papilla::side_px; ++Row)
    {
        for (int32 Column = 0; Column < papilla::side_px; ++Column)
        {
            SedJPerM3[Row * papilla::side_px + Column] = Answer.at(Row, Column);
        }
    }
    return true;
}

bool UPapillaSessionComponent::GetSedAtVertices(TArray<float>& SedJPerM3) const
{
    const int32 Count = bHasAnswer ? static_cast<int32>(Answer.vertices.size()) : 0;
    SedJPerM3.SetNumUninitialized(Count);
    if (Count > 0) FMemory::Memcpy(SedJPerM3.GetData(), Answer.vertices.data(), Count * sizeof(float));
    return Count > 0;
}

bool UPapillaSessionComponent::GetSkin(TArray<FVector>& Vertices, TArray<int32>& Triangles) const
{
    if (!bHasAtlas) return false;
    Vertices.Reset();
    Triangles.Reset();
    for (const std::array<double, 3>& At : Atlas.positions_mm) Vertices.Add(UPapillaFrames::Drawn(FVector(At[0], At[1], At[2])));
    for (const std::array<std::uint32_t, 3>& Corners : Atlas.triangles)
    {
        for (const std::uint32_t Corner : Corners) Triangles.Add(static_cast<int32>(Corner));
    }
    return true;
}

TMap<FString, FString> UPapillaSessionComponent::Headers() const
{
    TMap<FString, FString> Found;
    if (!CleanToken.empty()) Found.Add(TEXT("Authorization"), TEXT("Bearer ") + ToFString(CleanToken));
    return Found;
}

void UPapillaSessionComponent::FetchAtlas()
{
    const auto Request = FHttpModule::Get().CreateRequest();
    // As long as a request may wait for models that are being loaded.
    Request->SetTimeout(30.0f);
    // The skin that is drawn is that of the session's first finger. A name needs no escape: one that did
    // would be refused with the hello.
    const std::string Name = Hello.Fingers.Num() > 0 ? ToUtf8(Hello.Fingers[0].Name) : std::string();
    Request->SetURL(ToFString(Address.http(Name.empty() ? "/v1/atlas" : "/v1/atlas?finger=" + Name)));
    for (const TPair<FString, FString>& Header : Headers()) Request->SetHeader(Header.Key, Header.Value);
    TWeakObjectPtr<UPapillaSessionComponent> Weak(this);
    Request->OnProcessRequestComplete().BindLambda([Weak](FHttpRequestPtr, FHttpResponsePtr Response, bool bGood)
    {
        UPapillaSessionComponent* Self = Weak.Get();
        if (!Self || !bGood || !Response || Response->GetResponseCode() != 200 || Self->bHasAtlas) return;
        Self->bHasAtlas = Self->Atlas.parse(ToUtf8(Response->GetContentAsString()));
    });
    Request->ProcessRequest();
}
