// Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
// What a session asks for, as Unreal's editor and Blueprints show it; papilla/hello.hpp says it to the service.
#pragma once

#include "CoreMinimal.h"

#include <papilla/hello.hpp>

#include "PapillaHello.generated.h"

namespace PapillaHello
{
inline std::string Text(const FString& Of) { return std::string(TCHAR_TO_UTF8(*Of)); }
inline std::array<double, 3> Three(const FVector& Of) { return {Of.X, Of.Y, Of.Z}; }
}  // namespace PapillaHello

/** What the frames of a session hold. */
UENUM(BlueprintType)
enum class EPapillaFrameInput : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Pressure,
    Objects,
    Gaps,
};

/** The places of samples: the pixels of the map, or the vertices of the atlas. */
UENUM(BlueprintType)
enum class EPapillaSampleLayout : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Map,
    Vertices,
};

/** What happens to pressure beyond the training of the tier: it is reduced, or sent on and flagged, or the frame is refused. */
UENUM(BlueprintType)
enum class EPapillaOutOfRangeRule : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Clamp,
    Flag,
    Refuse,
};

/** How the service finds the pressure from objects or gaps, from accurate to fast. */
UENUM(BlueprintType)
enum class EPapillaContactMethod : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Pixels,
    CoarsePixels,
    SecondOrder,
    SmallStrain,
    Springs,
};

/** What drives the actuators: SED (J/m3), or firing rates (Hz). */
UENUM(BlueprintType)
enum class EPapillaActuatorInput : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Sed,
    Sa1Rate,
};

/** How intensities are computed: each actuator by itself, or all pins fitted together, or that and corrected once by the network. */
UENUM(BlueprintType)
enum class EPapillaActuatorDrive : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Formula,
    Fitted,
    Corrected,
};

/** Class of a simulated nerve fibre: slowly adapting, rapidly adapting, Pacinian. */
UENUM(BlueprintType)
enum class EPapillaUnitClass : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Sa1,
    Ra,
    Pc,
};

/** Tissue whose measured creep is used. */
UENUM(BlueprintType)
enum class EPapillaTissue : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Subcutaneous,
    Skin,
};

/** Which stiffness the training of the tier had: that right after a step, or that after a long time. */
UENUM(BlueprintType)
enum class EPapillaModuli : uint8
{
    Usual UMETA(DisplayName = "the default"),
    Instantaneous,
    LongTerm,
};

/** Type of the samples. */
UENUM(BlueprintType)
enum class EPapillaSampleType : uint8
{
    Usual UMETA(DisplayName = "the default"),
    F32,
    F16,
    U16,
    U8,
};

/** A place on the finger. */
USTRUCT(BlueprintType)
struct FPapillaSkinPoint
{
    GENERATED_BODY()

    /** Whether it is a point of the map, and not of the finger. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bIsOnMap = false;

    /** A point of the undeformed finger, mm in the finger's frame: the nearest pixel, at most 2 mm off. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "!bIsOnMap"))
    FVector AtMm = FVector(11.25, 0.0, -6.5);

    /** A point of the map, pixels; y down. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "bIsOnMap"))
    FVector2D AtPx = FVector2D::ZeroVector;

    papilla::SkinPoint ToCore() const
    {
        return bIsOnMap ? papilla::SkinPoint::px(AtPx.X, AtPx.Y) : papilla::SkinPoint::mm(AtMm.X, AtMm.Y, AtMm.Z);
    }
};

/** Which shape it is. */
UENUM(BlueprintType)
enum class EPapillaShapeKind : uint8
{
    Plate,
    Sphere,
    Cylinder,
    Wedge,
    Punch,
    Ring,
    Box,
    Capsule,
    Torus,
    Grating,
    Dots,
    Heightmap,
    Mesh,
    Other,
};

/** A shape of an object. Lengths are in mm, above 0 and at most 1000 unless a member says otherwise. */
USTRUCT(BlueprintType)
struct FPapillaShape
{
    GENERATED_BODY()

    /** Which shape it is; its own dimensions alone are read. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaShapeKind Kind = EPapillaShapeKind::Sphere;

    /** A flat plate with rounded edges, 4 mm and twice the edge radius thick. Its origin is its middle. Side lengths along x and y, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Plate", EditConditionHides))
    FVector2D PlateSizeMm = FVector2D(20.0, 20.0);

    /** A flat plate with rounded edges, 4 mm and twice the edge radius thick. Its origin is its middle. Radius of its edges, mm: 0 to half the shorter side. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Plate", EditConditionHides))
    double PlateEdgeRadiusMm = 1.0;

    /** A ball. Its origin is its centre. Radius, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Sphere", EditConditionHides))
    double SphereRadiusMm = 5.0;

    /** A bar that lies along its y, with rounded ends. Its origin is the middle of its axis. Radius, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Cylinder", EditConditionHides))
    double CylinderRadiusMm = 3.0;

    /** A bar that lies along its y, with rounded ends. Its origin is the middle of its axis. Length with its rounded ends, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Cylinder", EditConditionHides))
    double CylinderLengthMm = 30.0;

    /** A bar that lies along its y, with rounded ends. Its origin is the middle of its axis. Rounds the ends, mm: at most the radius; equal to it they are half spheres. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Cylinder", EditConditionHides))
    double CylinderEndRadiusMm = 1.0;

    /** A blunt wedge along its y. Its origin is the middle of its tip. Width at the tip, mm, before its edges are rounded. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Wedge", EditConditionHides))
    double WedgeTipWidthMm = 0.05;

    /** A blunt wedge along its y. Its origin is the middle of its tip. Width at the base, mm, before its edges are rounded: at least that at the tip. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Wedge", EditConditionHides))
    double WedgeBaseWidthMm = 1.0;

    /** A blunt wedge along its y. Its origin is the middle of its tip. Height, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Wedge", EditConditionHides))
    double WedgeHeightMm = 2.0;

    /** A blunt wedge along its y. Its origin is the middle of its tip. Radius of all edges, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Wedge", EditConditionHides))
    double WedgeTipRadiusMm = 0.02;

    /** A blunt wedge along its y. Its origin is the middle of its tip. Length along y, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Wedge", EditConditionHides))
    double WedgeLengthMm = 30.0;

    /** An upright cylinder with a flat end. Its origin is the middle of that end. Outer radius, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Punch", EditConditionHides))
    double PunchRadiusMm = 3.0;

    /** An upright cylinder with a flat end. Its origin is the middle of that end. Rounds the rim, mm: at most the radius and half the height. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Punch", EditConditionHides))
    double PunchRimRadiusMm = 0.25;

    /** An upright cylinder with a flat end. Its origin is the middle of that end. Height, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Punch", EditConditionHides))
    double PunchHeightMm = 6.0;

    /** The end of an upright tube. Its origin is the middle of that end. Outer radius, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Ring", EditConditionHides))
    double RingOuterRadiusMm = 4.0;

    /** The end of an upright tube. Its origin is the middle of that end. Radius of the hole, mm: below the outer radius. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Ring", EditConditionHides))
    double RingInnerRadiusMm = 3.0;

    /** The end of an upright tube. Its origin is the middle of that end. Rounds all four rims, mm: at most half the wall and half the height. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Ring", EditConditionHides))
    double RingRimRadiusMm = 0.25;

    /** The end of an upright tube. Its origin is the middle of that end. Height, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Ring", EditConditionHides))
    double RingHeightMm = 6.0;

    /** A box with rounded edges. Its origin is its middle. Side lengths along x, y and z, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Box", EditConditionHides))
    FVector BoxSizeMm = FVector(10.0, 10.0, 10.0);

    /** A box with rounded edges. Its origin is its middle. Radius of its edges, mm: above 0, at most half the shortest side. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Box", EditConditionHides))
    double BoxEdgeRadiusMm = 1.0;

    /** A bar that lies along its y and ends in half balls. Its origin is its middle. Radius, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Capsule", EditConditionHides))
    double CapsuleRadiusMm = 3.0;

    /** A bar that lies along its y and ends in half balls. Its origin is its middle. Length with both half balls, mm: at least twice the radius. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Capsule", EditConditionHides))
    double CapsuleLengthMm = 20.0;

    /** A ring of round section that lies flat, its hole along its z. Its origin is its middle. Radius of the circle in the middle of the tube, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Torus", EditConditionHides))
    double TorusRadiusMm = 4.0;

    /** A ring of round section that lies flat, its hole along its z. Its origin is its middle. Radius of the tube, mm: below that of the circle. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Torus", EditConditionHides))
    double TorusTubeRadiusMm = 1.0;

    /** Ridges along y on a base. Its origin lies in the plane of their tops, in the middle. Number of ridges: 1 to 1000. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Grating", EditConditionHides))
    int32 GratingRidges = 5;

    /** Ridges along y on a base. Its origin lies in the plane of their tops, in the middle. Width of a ridge, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Grating", EditConditionHides))
    double GratingRidgeMm = 1.5;

    /** Ridges along y on a base. Its origin lies in the plane of their tops, in the middle. Width of a groove, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Grating", EditConditionHides))
    double GratingGrooveMm = 1.5;

    /** Ridges along y on a base. Its origin lies in the plane of their tops, in the middle. Depth of the grooves, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Grating", EditConditionHides))
    double GratingHeightMm = 1.5;

    /** Ridges along y on a base. Its origin lies in the plane of their tops, in the middle. Radius of all edges, mm: at most half a ridge, half the length and 2 mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Grating", EditConditionHides))
    double GratingEdgeRadiusMm = 0.25;

    /** Ridges along y on a base. Its origin lies in the plane of their tops, in the middle. Length along y, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Grating", EditConditionHides))
    double GratingLengthMm = 20.0;

    /** Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle. Dots along x and y: 1 to 1000 each. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Dots", EditConditionHides))
    FIntPoint DotsCount = FIntPoint(3, 2);

    /** Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle. Distance of neighbours, mm: at least the width of a dot. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Dots", EditConditionHides))
    double DotsPitchMm = 2.34;

    /** Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle. Width of a dot where it meets the plate, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Dots", EditConditionHides))
    double DotsBaseMm = 1.44;

    /** Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle. Height of a dot, mm: at most half its width. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Dots", EditConditionHides))
    double DotsHeightMm = 0.48;

    /** Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle. Side lengths of the plate, mm; it has to hold the dots and 1 mm around them. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Dots", EditConditionHides))
    FVector2D DotsPlateMm = FVector2D(20.0, 20.0);

    /** A surface of listed heights. Its origin is the middle of the grid. Number of heights along x: 2 or more. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Heightmap", EditConditionHides))
    int32 HeightmapColumns = 2;

    /** A surface of listed heights. Its origin is the middle of the grid. Distance between neighbouring heights along x and y, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Heightmap", EditConditionHides))
    FVector2D HeightmapPixelMm = FVector2D(0.1, 0.1);

    /** A surface of listed heights. Its origin is the middle of the grid. Heights above the origin, mm, row by row from the lowest y; two rows or more. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Heightmap", EditConditionHides))
    TArray<double> HeightmapHeightsMm;

    /** A mesh of at most 16 384 triangles. Its origin is that of its vertices. The service mends one that is not closed, and says so. x, y, z of each vertex, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Mesh", EditConditionHides))
    TArray<FVector> MeshVerticesMm;

    /** A mesh of at most 16 384 triangles. Its origin is that of its vertices. The service mends one that is not closed, and says so. Three vertices for each triangle, counter-clockwise as seen from outside. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Mesh", EditConditionHides))
    TArray<FIntVector> MeshTriangles;

    /** Name of a shape that this client does not know. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Other", EditConditionHides))
    FString OtherName;

    /** Members of a shape that this client does not know, as JSON without braces. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "Kind == EPapillaShapeKind::Other", EditConditionHides))
    FString OtherJson;

    papilla::Shape ToCore() const
    {
        switch (Kind)
        {
        case EPapillaShapeKind::Plate:
        {
            papilla::PlateShape Out;
            Out.size_mm = {PlateSizeMm.X, PlateSizeMm.Y};
            Out.edge_radius_mm = PlateEdgeRadiusMm;
            return Out;
        }
        case EPapillaShapeKind::Sphere:
        {
            papilla::SphereShape Out;
            Out.radius_mm = SphereRadiusMm;
            return Out;
        }
        case EPapillaShapeKind::Cylinder:
        {
            papilla::CylinderShape Out;
            Out.radius_mm = CylinderRadiusMm;
            Out.length_mm = CylinderLengthMm;
            Out.end_radius_mm = CylinderEndRadiusMm;
            return Out;
        }
        case EPapillaShapeKind::Wedge:
        {
            papilla::WedgeShape Out;
            Out.tip_width_mm = WedgeTipWidthMm;
            Out.base_width_mm = WedgeBaseWidthMm;
            Out.height_mm = WedgeHeightMm;
            Out.tip_radius_mm = WedgeTipRadiusMm;
            Out.length_mm = WedgeLengthMm;
            return Out;
        }
        case EPapillaShapeKind::Punch:
        {
            papilla::PunchShape Out;
            Out.radius_mm = PunchRadiusMm;
            Out.rim_radius_mm = PunchRimRadiusMm;
            Out.height_mm = PunchHeightMm;
            return Out;
        }
        case EPapillaShapeKind::Ring:
        {
            papilla::RingShape Out;
            Out.outer_radius_mm = RingOuterRadiusMm;
            Out.inner_radius_mm = RingInnerRadiusMm;
            Out.rim_radius_mm = RingRimRadiusMm;
            Out.height_mm = RingHeightMm;
            return Out;
        }
        case EPapillaShapeKind::Box:
        {
            papilla::BoxShape Out;
            Out.size_mm = PapillaHello::Three(BoxSizeMm);
            Out.edge_radius_mm = BoxEdgeRadiusMm;
            return Out;
        }
        case EPapillaShapeKind::Capsule:
        {
            papilla::CapsuleShape Out;
            Out.radius_mm = CapsuleRadiusMm;
            Out.length_mm = CapsuleLengthMm;
            return Out;
        }
        case EPapillaShapeKind::Torus:
        {
            papilla::TorusShape Out;
            Out.radius_mm = TorusRadiusMm;
            Out.tube_radius_mm = TorusTubeRadiusMm;
            return Out;
        }
        case EPapillaShapeKind::Grating:
        {
            papilla::GratingShape Out;
            Out.ridges = static_cast<std::uint32_t>(FMath::Max(GratingRidges, 0));
            Out.ridge_mm = GratingRidgeMm;
            Out.groove_mm = GratingGrooveMm;
            Out.height_mm = GratingHeightMm;
            Out.edge_radius_mm = GratingEdgeRadiusMm;
            Out.length_mm = GratingLengthMm;
            return Out;
        }
        case EPapillaShapeKind::Dots:
        {
            papilla::DotsShape Out;
            Out.count = {static_cast<std::uint32_t>(DotsCount.X), static_cast<std::uint32_t>(DotsCount.Y)};
            Out.pitch_mm = DotsPitchMm;
            Out.base_mm = DotsBaseMm;
            Out.height_mm = DotsHeightMm;
            Out.plate_mm = {DotsPlateMm.X, DotsPlateMm.Y};
            return Out;
        }
        case EPapillaShapeKind::Heightmap:
        {
            papilla::HeightmapShape Out;
            Out.columns = static_cast<std::uint32_t>(FMath::Max(HeightmapColumns, 0));
            Out.pixel_mm = {HeightmapPixelMm.X, HeightmapPixelMm.Y};
            for (const double One : HeightmapHeightsMm) Out.heights_mm.push_back(One);
            return Out;
        }
        case EPapillaShapeKind::Mesh:
        {
            papilla::MeshShape Out;
            for (const FVector& One : MeshVerticesMm) Out.vertices_mm.push_back(PapillaHello::Three(One));
            for (const FIntVector& One : MeshTriangles) Out.triangles.push_back({static_cast<std::uint32_t>(One.X), static_cast<std::uint32_t>(One.Y), static_cast<std::uint32_t>(One.Z)});
            return Out;
        }
        case EPapillaShapeKind::Other:
            break;
        }
        return papilla::OtherShape{PapillaHello::Text(OtherName), PapillaHello::Text(OtherJson)};
    }
};

/** A part of a union, moved and turned in the union's axes. */
USTRUCT(BlueprintType)
struct FPapillaUnionPart
{
    GENERATED_BODY()

    /** What it is: any shape but a union. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FPapillaShape Part;

    /** Where its own origin lies, mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FVector AtMm = FVector(0.0, 0.0, 0.0);

    /** Turn about the union's z, degrees: the first of the three. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double YawDeg = 0.0;

    /** Turn about the union's y, degrees. A height map has to leave it 0. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double PitchDeg = 0.0;

    /** Turn about the union's x, degrees. A height map has to leave it 0. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double RollDeg = 0.0;

    papilla::UnionPart ToCore() const
    {
        papilla::UnionPart Out;
        Out.part = Part.ToCore();
        Out.at_mm = PapillaHello::Three(AtMm);
        Out.yaw_deg = YawDeg;
        Out.pitch_deg = PitchDeg;
        Out.roll_deg = RollDeg;
        return Out;
    }
};

/** What an object is made of, as far as the skin feels it. */
USTRUCT(BlueprintType)
struct FPapillaMaterial
{
    GENERATED_BODY()

    /** The pressure that pushes its surface in by 1 mm, MPa/mm: above 0. 0: it is rigid. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double StiffnessMpaPerMm = 0;

    /** Coulomb's coefficient of friction with the skin: 0 to 10. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Friction = 0.0;

    papilla::TouchMaterial ToCore() const
    {
        papilla::TouchMaterial Out;
        if (StiffnessMpaPerMm != 0) Out.stiffness_mpa_per_mm = StiffnessMpaPerMm;
        Out.friction = Friction;
        return Out;
    }
};

/** An object that can be touched; each frame gives its pose. */
USTRUCT(BlueprintType)
struct FPapillaObject
{
    GENERATED_BODY()

    /** Its shape, and its size in millimetres. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FPapillaShape Shape;

    /** Parts that move as one body; where there are any, Shape is not read. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaUnionPart> Parts;

    /** What it is made of; by default rigid and without friction. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FPapillaMaterial Material;

    papilla::TouchObject ToCore() const
    {
        papilla::TouchObject Out;
        Out.shape = Shape.ToCore();
        if (Parts.Num() > 0)
        {
            papilla::UnionShape All;
            for (const FPapillaUnionPart& One : Parts) All.parts.push_back(One.ToCore());
            Out.shape = All;
        }
        Out.material = Material.ToCore();
        return Out;
    }
};

/** A finger of the session. */
USTRUCT(BlueprintType)
struct FPapillaFinger
{
    GENERATED_BODY()

    /** Which of the service's fingers it is, as GET /v1/fingers lists them. Empty: the default finger. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FString Name;

    /** Its width divided by that of the finger of this name: 0.25 to 4. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Width = 1.0;

    /** Stiffness of its tissue divided by that of the finger of this name: 0.25 to 4. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Stiffness = 1.0;

    papilla::TouchFinger ToCore() const
    {
        papilla::TouchFinger Out;
        Out.name = PapillaHello::Text(Name);
        Out.width = Width;
        Out.stiffness = Stiffness;
        return Out;
    }
};

/** An actuator of a tactile display. */
USTRUCT(BlueprintType)
struct FPapillaActuator
{
    GENERATED_BODY()

    /** Its place on the finger. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FPapillaSkinPoint At;

    /** Radius of what it averages over, or of its pin, mm. -1: that of the effect. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double RadiusMm = -1.0;

    /** Intensity for each unit of the input above the threshold. -1: that of the effect. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Gain = -1.0;

    /** Input below which the intensity is 0. -1: that of the effect. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Threshold = -1.0;

    papilla::Actuator ToCore() const
    {
        papilla::Actuator Out;
        Out.at = At.ToCore();
        if (RadiusMm >= 0) Out.radius_mm = RadiusMm;
        if (Gain >= 0) Out.gain = Gain;
        if (Threshold >= 0) Out.threshold = Threshold;
        return Out;
    }
};

/** A simulated nerve fibre. */
USTRUCT(BlueprintType)
struct FPapillaNerveUnit
{
    GENERATED_BODY()

    /** Its class. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaUnitClass UnitClass = EPapillaUnitClass::Usual;

    /** Its place on the finger. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FPapillaSkinPoint At;

    /** Which of TouchSim's neurons of the class: 0 to 3, for ra 0 to 8. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    int32 Model = 0;

    papilla::NerveUnit ToCore() const
    {
        papilla::NerveUnit Out;
        if (UnitClass != EPapillaUnitClass::Usual) Out.unit_class = static_cast<papilla::UnitClass>(static_cast<uint8>(UnitClass) - 1);
        Out.at = At.ToCore();
        Out.model = static_cast<std::uint32_t>(FMath::Max(Model, 0));
        return Out;
    }
};

/** A term of a Prony series. */
USTRUCT(BlueprintType)
struct FPapillaPronyTerm
{
    GENERATED_BODY()

    /** Share of the modulus that relaxes: above 0; all together at most 0.99. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double G = 0.0;

    /** Its time constant, s. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double TauS = 1.0;

    papilla::PronyTerm ToCore() const
    {
        papilla::PronyTerm Out;
        Out.g = G;
        Out.tau_s = TauS;
        return Out;
    }
};

/** Answers carry firing rates of slowly adapting nerve fibres, Hz. */
USTRUCT(BlueprintType)
struct FPapillaAfferentsEffect
{
    GENERATED_BODY()

    /** Elastic modulus of the dermis, kPa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double ERefKpa = 80.0;

    /** Threshold, kPa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double ThetaKpa = 8.0;

    /** Static sensitivity, Hz/kPa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double KSHzPerKpa = 1.0;

    /** Dynamic sensitivity, Hz s/kPa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double KDHzSPerKpa = 0.2;

    /** False: no map of rates; points, summary and actuators still use them. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bMap = true;

    papilla::AfferentsEffect ToCore() const
    {
        papilla::AfferentsEffect Out;
        Out.e_ref_kpa = ERefKpa;
        Out.theta_kpa = ThetaKpa;
        Out.k_s_hz_per_kpa = KSHzPerKpa;
        Out.k_d_hz_s_per_kpa = KDHzSPerKpa;
        Out.map = bMap;
        return Out;
    }
};

/** Answers carry when simulated nerve fibres fired. */
USTRUCT(BlueprintType)
struct FPapillaSpikesEffect
{
    GENERATED_BODY()

    /** Seed of the random places, of the models of units and of the noise. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    int32 Seed = 1;

    /** Slowly adapting units for each cm2. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Sa1PerCm2 = 70.0;

    /** Rapidly adapting units for each cm2. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double RaPerCm2 = 140.0;

    /** Pacinian units for each cm2. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double PcPerCm2 = 21.0;

    /** Units of your own in place of those at random, 1 to 4096. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaNerveUnit> Units;

    /** Elastic modulus of the dermis, kPa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double ERefKpa = 80.0;

    /** Whether noise is added to the membranes. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bNoise = false;

    /** Most spikes in one answer: 1 to 16384. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    int32 SpikesMax = 1024;

    papilla::SpikesEffect ToCore() const
    {
        papilla::SpikesEffect Out;
        Out.seed = static_cast<std::uint32_t>(FMath::Max(Seed, 0));
        Out.sa1_per_cm2 = Sa1PerCm2;
        Out.ra_per_cm2 = RaPerCm2;
        Out.pc_per_cm2 = PcPerCm2;
        for (const FPapillaNerveUnit& One : Units) Out.units.push_back(One.ToCore());
        Out.e_ref_kpa = ERefKpa;
        Out.noise = bNoise;
        Out.spikes_max = static_cast<std::uint32_t>(FMath::Max(SpikesMax, 0));
        return Out;
    }
};

/** Answers carry an intensity for each actuator of a tactile display. */
USTRUCT(BlueprintType)
struct FPapillaActuatorsEffect
{
    GENERATED_BODY()

    /** The actuators, 1 to 1024. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaActuator> Actuators;

    /** Radius of what an actuator averages over, or of its pin, mm, where it has none of its own. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double RadiusMm = 0;

    /** Intensity for each unit of the input above the threshold, where an actuator has none of its own. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Gain = 0;

    /** Input below which the intensity is 0, in its unit. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Threshold = 0.0;

    /** Greatest intensity. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Max = 1.0;

    /** What drives them; firing rates need the effect afferents. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaActuatorInput Input = EPapillaActuatorInput::Usual;

    /** How intensities are computed. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaActuatorDrive Drive = EPapillaActuatorDrive::Usual;

    papilla::ActuatorsEffect ToCore() const
    {
        papilla::ActuatorsEffect Out;
        for (const FPapillaActuator& One : Actuators) Out.actuators.push_back(One.ToCore());
        if (RadiusMm != 0) Out.radius_mm = RadiusMm;
        if (Gain != 0) Out.gain = Gain;
        Out.threshold = Threshold;
        Out.max = Max;
        if (Input != EPapillaActuatorInput::Usual) Out.input = static_cast<papilla::ActuatorInput>(static_cast<uint8>(Input) - 1);
        if (Drive != EPapillaActuatorDrive::Usual) Out.drive = static_cast<papilla::ActuatorDrive>(static_cast<uint8>(Drive) - 1);
        return Out;
    }
};

/** The tissue creeps under a constant pressure. */
USTRUCT(BlueprintType)
struct FPapillaRelaxationEffect
{
    GENERATED_BODY()

    /** Whose creep it is. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaTissue Tissue = EPapillaTissue::Usual;

    /** A series of your own in place of the tissue's, one to six terms. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaPronyTerm> Prony;

    /** Which stiffness the training had. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaModuli Moduli = EPapillaModuli::Usual;

    papilla::RelaxationEffect ToCore() const
    {
        papilla::RelaxationEffect Out;
        if (Tissue != EPapillaTissue::Usual) Out.tissue = static_cast<papilla::Tissue>(static_cast<uint8>(Tissue) - 1);
        for (const FPapillaPronyTerm& One : Prony) Out.prony.push_back(One.ToCore());
        if (Moduli != EPapillaModuli::Usual) Out.moduli = static_cast<papilla::Moduli>(static_cast<uint8>(Moduli) - 1);
        return Out;
    }
};

/** The map is cut to the region in contact. */
USTRUCT(BlueprintType)
struct FPapillaContactWindowEffect
{
    GENERATED_BODY()

    /** Margin around it, pixels. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    int32 MarginPx = 24;

    papilla::ContactWindowEffect ToCore() const
    {
        papilla::ContactWindowEffect Out;
        Out.margin_px = static_cast<std::uint32_t>(FMath::Max(MarginPx, 0));
        return Out;
    }
};

/** What a session asks for. What is not set takes the service's default. */
USTRUCT(BlueprintType)
struct FPapillaHello
{
    GENERATED_BODY()

    /** What frames hold. Usual: objects if there are any in the hello, pressure if not. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaFrameInput Input = EPapillaFrameInput::Usual;

    /** Places of the samples of pressure or gaps. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaSampleLayout InputLayout = EPapillaSampleLayout::Usual;

    /** Type of the samples of frames. Poses are f32; gaps are f32 or f16. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaSampleType SampleType = EPapillaSampleType::Usual;

    /** Pressure that one unit of a u16 or u8 sample stands for, Pa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double PressureScalePa = 0;

    /** What happens to pressure beyond the training. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaOutOfRangeRule OutOfRange = EPapillaOutOfRangeRule::Usual;

    /** Frames of pressure at vertices also hold the traction. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bTraction = false;

    /** The objects, 1 to 16, whose poses frames hold. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaObject> Objects;

    /** The fingers, 1 to 10. None: the default finger alone. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaFinger> Fingers;

    /** Each frame holds a net force with which the objects are to press. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bForceTarget = false;

    /** Coulomb's coefficient of friction of what gaps tell of: 0 to 10. 0: none. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double Friction = 0;

    /** Frames of gaps also hold velocities, mm/s. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bVelocity = false;

    /** A frame that was delayed for longer on its way is stale, us. 0: none is. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    int32 StaleAfterUs = 0;

    /** False: answers carry no SED at pixels or vertices. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bMap = true;

    /** Places of the SED in answers. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaSampleLayout AnswerLayout = EPapillaSampleLayout::Usual;

    /** Type of SED and firing rates in answers. Usual: that of frames. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaSampleType AnswerSampleType = EPapillaSampleType::Usual;

    /** Answers to objects and gaps carry the pressure that was found, Pa, at these places. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaSampleLayout Pressure = EPapillaSampleLayout::Usual;

    /** Answers to objects and gaps carry the traction along the skin, Pa, at the vertices. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bShear = false;

    /** Answers to objects and gaps carry how far the skin has moved, mm, at the vertices. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bDisplacement = false;

    /** Answers say how wrong they are likely to be. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bErrorEstimate = false;

    /** Answers to objects and gaps carry the local stiffness, N/mm. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bStiffness = false;

    /** Pressure above which a pixel counts as in contact, Pa. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    double ContactPa = 0.0;

    /** A tier by its name. Empty: the service chooses, by the budget if there is one. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FString Tier;

    /** Time that a frame may spend in the service, us. 0: no deadline. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    int32 BudgetUs = 0;

    /** How contact is solved. Usual: the most accurate method that can serve the hello. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    EPapillaContactMethod Method = EPapillaContactMethod::Usual;

    /** Hash of the atlas that you draw with; the hello is refused if the tier has another. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FString AtlasHash;

    /** The effect summary. Answers carry a summary: force, contact area and fourteen other numbers. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseSummary = false;

    /** The effect points: answers carry SED at these, 1 to 1024; none: no such effect. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FPapillaSkinPoint> Points;

    /** The effect afferents. Answers carry firing rates of slowly adapting nerve fibres, Hz. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseAfferents = false;

    /** Parameters of the effect afferents. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "bUseAfferents"))
    FPapillaAfferentsEffect Afferents;

    /** The effect spikes. Answers carry when simulated nerve fibres fired. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseSpikes = false;

    /** Parameters of the effect spikes. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "bUseSpikes"))
    FPapillaSpikesEffect Spikes;

    /** The effect actuators. Answers carry an intensity for each actuator of a tactile display. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseActuators = false;

    /** Parameters of the effect actuators. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "bUseActuators"))
    FPapillaActuatorsEffect Actuators;

    /** The effect relaxation. The tissue creeps under a constant pressure. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseRelaxation = false;

    /** Parameters of the effect relaxation. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "bUseRelaxation"))
    FPapillaRelaxationEffect Relaxation;

    /** The effect shear_energy. SED takes account of traction along the skin; needs friction. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseShearEnergy = false;

    /** The effect contact_window. The map is cut to the region in contact. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    bool bUseContactWindow = false;

    /** Parameters of the effect contact_window. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla", meta = (EditCondition = "bUseContactWindow"))
    FPapillaContactWindowEffect ContactWindow;

    /** Names of effects that this client does not know, such as those of a tier. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    TArray<FString> OtherEffects;

    /** Members that this client does not know, as JSON without braces. */
    UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla")
    FString More;

    papilla::Hello ToCore() const
    {
        papilla::Hello Out;
        if (Input != EPapillaFrameInput::Usual) Out.input = static_cast<papilla::FrameInput>(static_cast<uint8>(Input) - 1);
        if (InputLayout != EPapillaSampleLayout::Usual) Out.input_layout = static_cast<papilla::SampleLayout>(static_cast<uint8>(InputLayout) - 1);
        if (SampleType != EPapillaSampleType::Usual) Out.sample_type = static_cast<papilla::SampleType>(static_cast<uint8>(SampleType) - 1);
        if (PressureScalePa != 0) Out.pressure_scale_pa = PressureScalePa;
        if (OutOfRange != EPapillaOutOfRangeRule::Usual) Out.out_of_range = static_cast<papilla::OutOfRangeRule>(static_cast<uint8>(OutOfRange) - 1);
        Out.traction = bTraction;
        for (const FPapillaObject& One : Objects) Out.objects.push_back(One.ToCore());
        for (const FPapillaFinger& One : Fingers) Out.fingers.push_back(One.ToCore());
        Out.force_target = bForceTarget;
        if (Friction != 0) Out.friction = Friction;
        Out.velocity = bVelocity;
        if (StaleAfterUs != 0) Out.stale_after_us = static_cast<std::uint32_t>(FMath::Max(StaleAfterUs, 0));
        Out.map = bMap;
        if (AnswerLayout != EPapillaSampleLayout::Usual) Out.answer_layout = static_cast<papilla::SampleLayout>(static_cast<uint8>(AnswerLayout) - 1);
        if (AnswerSampleType != EPapillaSampleType::Usual) Out.answer_sample_type = static_cast<papilla::SampleType>(static_cast<uint8>(AnswerSampleType) - 1);
        if (Pressure != EPapillaSampleLayout::Usual) Out.pressure = static_cast<papilla::SampleLayout>(static_cast<uint8>(Pressure) - 1);
        Out.shear = bShear;
        Out.displacement = bDisplacement;
        Out.error_estimate = bErrorEstimate;
        Out.stiffness = bStiffness;
        Out.contact_pa = ContactPa;
        Out.tier = PapillaHello::Text(Tier);
        if (BudgetUs != 0) Out.budget_us = static_cast<std::uint32_t>(FMath::Max(BudgetUs, 0));
        if (Method != EPapillaContactMethod::Usual) Out.method = static_cast<papilla::ContactMethod>(static_cast<uint8>(Method) - 1);
        Out.atlas_hash = PapillaHello::Text(AtlasHash);
        if (bUseSummary) Out.effects.push_back(papilla::SummaryEffect{});
        if (Points.Num() > 0)
        {
            papilla::PointsEffect All;
            for (const FPapillaSkinPoint& One : Points) All.points.push_back(One.ToCore());
            Out.effects.push_back(All);
        }
        if (bUseAfferents) Out.effects.push_back(Afferents.ToCore());
        if (bUseSpikes) Out.effects.push_back(Spikes.ToCore());
        if (bUseActuators) Out.effects.push_back(Actuators.ToCore());
        if (bUseRelaxation) Out.effects.push_back(Relaxation.ToCore());
        if (bUseShearEnergy) Out.effects.push_back(papilla::ShearEnergyEffect{});
        if (bUseContactWindow) Out.effects.push_back(ContactWindow.ToCore());
        for (const FString& One : OtherEffects) Out.effects.push_back(papilla::OtherEffect{PapillaHello::Text(One), {}});
        Out.more = PapillaHello::Text(More);
        return Out;
    }
};
