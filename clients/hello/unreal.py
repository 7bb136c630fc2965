"""The form of a hello that Unreal edits: clients/unreal/Papilla/Source/Papilla/Public/PapillaHello.h.

Unreal's structures have no optional members and no variants: an enumeration begins with `Usual`, a number that is left
out is 0 (-1 where 0 says something), and a shape is one structure with the dimensions of all of them.
"""

from csharp import pascal
from members import CONTACT, EFFECTS, ENUMERATIONS, HELLO, PARAMETERS, PART, SAMPLE_TYPE, SHAPES, Enumeration, Member, Structure

HEAD = """// Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
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
"""

POINT = """/** A place on the finger. */
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
"""

TYPES = {"number": "double", "whole": "int32", "flag": "bool", "text": "FString", "pair": "FVector2D", "triple": "FVector", "wholes": "FIntPoint",
         "vertices": "TArray<FVector>", "triangles": "TArray<FIntVector>", "numbers": "TArray<double>", "point": "FPapillaSkinPoint"}
#: Where 0 says something, so that -1 says that a number is left out.
FROM_ZERO = {("Actuator", "radius_mm"), ("Actuator", "gain"), ("Actuator", "threshold")}


def is_enum(kind: str) -> bool:
    return any(kind == each.name for each in (*ENUMERATIONS, SAMPLE_TYPE))


def type_of(kind: str) -> str:
    if kind.startswith("list "):
        return f"TArray<{type_of(kind.removeprefix('list '))}>"
    return TYPES.get(kind) or ("EPapilla" if is_enum(kind) else "FPapilla") + kind.removeprefix("Touch")


def unset(structure: Structure, member: Member) -> str:
    return "-1.0" if (structure.name, member.name) in FROM_ZERO else "0"


def initial(structure: Structure, member: Member) -> str:
    kind, default = member.kind, member.default
    if is_enum(kind):
        return f" = {type_of(kind)}::Usual"
    if kind == "flag":
        return f" = {str(default).lower()}"
    if kind in ("number", "whole"):
        return f" = {unset(structure, member) if default is None else default}"
    if kind in ("pair", "triple", "wholes"):
        return f" = {TYPES[kind]}({', '.join(str(v) for v in default)})"
    return ""


def field_name(member: Member, prefix: str = "") -> str:
    return ("b" if member.kind == "flag" else "") + prefix + pascal(member.name)


def doc(structure: Structure, member: Member) -> str:
    if member.default is None and member.kind in ("number", "whole"):
        return member.doc.replace("Left out:", f"{unset(structure, member).removesuffix('.0')}:")
    if is_enum(member.kind):
        return member.doc.replace("Left out:", "Usual:")
    return member.doc.replace("Left out:", "Empty:")


def property_of(text: str, declaration: str, meta: str = "") -> list[str]:
    more = f", meta = ({meta})" if meta else ""
    return [f"/** {text} */", f'UPROPERTY(EditAnywhere, BlueprintReadWrite, Category = "Papilla"{more})', declaration + ";", ""]


def copied(structure: Structure, member: Member, own: str, to: str) -> list[str]:
    """Statements that set a member of the core's structure."""
    kind = member.kind
    if member.item:
        return [f"for (const {type_of(member.item)}& One : {own}) {to}.push_back(One.ToCore());"]
    if is_enum(kind):
        return [f"if ({own} != {type_of(kind)}::Usual) {to} = static_cast<papilla::{kind}>(static_cast<uint8>({own}) - 1);"]
    if kind in ("number", "whole"):
        value = own if kind == "number" else f"static_cast<std::uint32_t>(FMath::Max({own}, 0))"
        if member.default is not None:
            return [f"{to} = {value};"]
        return [f"if ({own} {'>=' if (structure.name, member.name) in FROM_ZERO else '!='} 0) {to} = {value};"]
    if kind == "text":
        return [f"{to} = PapillaHello::Text({own});"]
    if kind == "pair":
        return [f"{to} = {{{own}.X, {own}.Y}};"]
    if kind == "triple":
        return [f"{to} = PapillaHello::Three({own});"]
    if kind == "wholes":
        return [f"{to} = {{static_cast<std::uint32_t>({own}.X), static_cast<std::uint32_t>({own}.Y)}};"]
    if kind == "vertices":
        return [f"for (const FVector& One : {own}) {to}.push_back(PapillaHello::Three(One));"]
    if kind == "triangles":
        three = ", ".join(f"static_cast<std::uint32_t>(One.{axis})" for axis in "XYZ")
        return [f"for (const FIntVector& One : {own}) {to}.push_back({{{three}}});"]
    if kind == "numbers":
        return [f"for (const double One : {own}) {to}.push_back(One);"]
    return [f"{to} = {own};"] if kind == "flag" else [f"{to} = {own}.ToCore();"]


def struct(name: str, text: str, fields: list[str], body: list[str], result: str) -> str:
    lines = [f"/** {text} */", "USTRUCT(BlueprintType)", f"struct {name}", "{", "    GENERATED_BODY()", "",
             *(("    " + line).rstrip() for line in fields), f"    {result} ToCore() const", "    {", *("        " + line for line in body), "    }", "};"]
    return "\n".join(lines) + "\n"


def plain(structure: Structure) -> str:
    """A structure whose members are those of the core's."""
    fields, body = [], [f"papilla::{structure.name} Out;"]
    for member in structure.members:
        name = field_name(member)
        fields += property_of(doc(structure, member), f"{type_of(member.kind)} {name}{initial(structure, member)}")
        body += copied(structure, member, name, f"Out.{member.name}")
    return struct("FPapilla" + structure.name.removeprefix("Touch"), structure.doc, fields, [*body, "return Out;"], f"papilla::{structure.name}")


def enumeration(each: Enumeration) -> str:
    words = "".join(f"    {pascal(w)},\n" for w in each.words)
    text = each.doc or "Type of the samples."
    return f'/** {text} */\nUENUM(BlueprintType)\nenum class EPapilla{each.name} : uint8\n{{\n    Usual UMETA(DisplayName = "the default"),\n{words}}};\n'


def shapes() -> str:
    """The dimensions of all shapes but unions."""
    kinds = SHAPES[:-1]
    names = [s.name.removesuffix("Shape") for s in kinds]
    enum = "".join(f"    {name},\n" for name in names)
    fields = property_of("Which shape it is; its own dimensions alone are read.", "EPapillaShapeKind Kind = EPapillaShapeKind::Sphere")
    body = ["switch (Kind)", "{"]
    for structure, name in zip(kinds, names):
        body += [f"case EPapillaShapeKind::{name}:", "{", f"    papilla::{structure.name} Out;"]
        for member in structure.members:
            own = field_name(member, name)
            meta = f'EditCondition = "Kind == EPapillaShapeKind::{name}", EditConditionHides'
            fields += property_of(f"{structure.doc} {member.doc}", f"{type_of(member.kind)} {own}{initial(structure, member)}", meta)
            body += ["    " + line for line in copied(structure, member, own, f"Out.{member.name}")]
        body += ["    return Out;", "}"]
    body += ["case EPapillaShapeKind::Other:", "    break;", "}",
             "return papilla::OtherShape{PapillaHello::Text(OtherName), PapillaHello::Text(OtherJson)};"]
    other = 'EditCondition = "Kind == EPapillaShapeKind::Other", EditConditionHides'
    fields += property_of("Name of a shape that this client does not know.", "FString OtherName", other)
    fields += property_of("Members of a shape that this client does not know, as JSON without braces.", "FString OtherJson", other)
    head = f"/** Which shape it is. */\nUENUM(BlueprintType)\nenum class EPapillaShapeKind : uint8\n{{\n{enum}    Other,\n}};\n\n"
    text = "A shape of an object. Lengths are in mm, above 0 and at most 1000 unless a member says otherwise."
    return head + struct("FPapillaShape", text, fields, body, "papilla::Shape")


def hello() -> str:
    fields, body = [], ["papilla::Hello Out;"]
    for member in HELLO.members:
        if member.name == "effects":
            continue
        name = field_name(member)
        fields += property_of(doc(HELLO, member), f"{type_of(member.kind)} {name}{initial(HELLO, member)}")
        body += copied(HELLO, member, name, f"Out.{member.name}")
    for effect in EFFECTS:
        name = effect.name.removesuffix("Effect")
        if effect.name == "PointsEffect":
            fields += property_of("The effect points: answers carry SED at these, 1 to 1024; none: no such effect.", "TArray<FPapillaSkinPoint> Points")
            body += ["if (Points.Num() > 0)", "{", "    papilla::PointsEffect All;",
                     "    for (const FPapillaSkinPoint& One : Points) All.points.push_back(One.ToCore());", "    Out.effects.push_back(All);", "}"]
            continue
        fields += property_of(f"The effect {effect.tag}. {effect.doc}", f"bool bUse{name} = false")
        if effect.members:
            fields += property_of(f"Parameters of the effect {effect.tag}.", f"FPapilla{effect.name} {name}", f'EditCondition = "bUse{name}"')
        body.append(f"if (bUse{name}) Out.effects.push_back(" + (f"{name}.ToCore()" if effect.members else f"papilla::{effect.name}{{}}") + ");")
    fields += property_of("Names of effects that this client does not know, such as those of a tier.", "TArray<FString> OtherEffects")
    fields += property_of("Members that this client does not know, as JSON without braces.", "FString More")
    body += ["for (const FString& One : OtherEffects) Out.effects.push_back(papilla::OtherEffect{PapillaHello::Text(One), {}});",
             "Out.more = PapillaHello::Text(More);", "return Out;"]
    return struct("FPapillaHello", f"{HELLO.doc} What is not set takes the service's default.", fields, body, "papilla::Hello")


def thing() -> str:
    """An object: a shape, or the parts of a union, for Unreal's structures do not hold themselves."""
    structure = next(s for s in CONTACT if s.name == "TouchObject")
    fields = property_of("Its shape, and its size in millimetres.", "FPapillaShape Shape")
    fields += property_of("Parts that move as one body; where there are any, Shape is not read.", "TArray<FPapillaUnionPart> Parts")
    fields += property_of(structure.members[1].doc, "FPapillaMaterial Material")
    body = ["papilla::TouchObject Out;", "Out.shape = Shape.ToCore();", "if (Parts.Num() > 0)", "{", "    papilla::UnionShape All;",
            "    for (const FPapillaUnionPart& One : Parts) All.parts.push_back(One.ToCore());", "    Out.shape = All;", "}",
            "Out.material = Material.ToCore();", "return Out;"]
    return struct("FPapillaObject", structure.doc, fields, body, "papilla::TouchObject")


def text() -> str:
    blocks = [HEAD, *(enumeration(each) for each in (*ENUMERATIONS, SAMPLE_TYPE)), POINT, shapes(), plain(PART)]
    blocks += [thing() if s.name == "TouchObject" else plain(s) for s in CONTACT]
    blocks += [plain(s) for s in PARAMETERS]
    blocks += [plain(s) for s in EFFECTS if s.members and s.name != "PointsEffect"]
    return "\n".join([*blocks, hello()])
