"""The C++ form of a hello: clients/cpp/include/papilla/hello.hpp."""

from members import CONTACT, EFFECTS, ENUMERATIONS, HELLO, PARAMETERS, PART, SHAPES, Enumeration, Member, Structure

HEAD = """// Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
// What a session asks for, as types; hello_text.hpp says them on the wire.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hello_text.hpp"
#include "wire.hpp"

namespace papilla {
"""

OTHER_SHAPE = """/// A shape that this client does not know: its members as JSON, without braces and without its name.
struct OtherShape {
  std::string name;
  std::string json;
};
"""

OTHER_EFFECT = """/// An effect that this client does not know, such as one of a tier: its name, and its parameters as JSON (empty: none).
struct OtherEffect {
  std::string name;
  std::string json;
};
"""

POINT = """/// A place on the finger: `SkinPoint::mm(11.25, 0, -6.5)` or `SkinPoint::px(112, 90)`.
struct SkinPoint {
  bool is_px = true;
  std::array<double, 3> at{};
  /// The pixel nearest to a point of the undeformed finger, mm in the finger's frame; at most 2 mm off.
  static SkinPoint mm(double x, double y, double z) { return {false, {x, y, z}}; }
  /// A point of the map, pixels; v down.
  static SkinPoint px(double u, double v) { return {true, {u, v, 0.0}}; }
};
"""

TEXT = """
  /// All members as JSON, without braces, type and version.
  std::string members() const {
    detail::HelloWriter out;
    if (!input && !objects.empty()) out("input", FrameInput::objects);
    visit(*this, out);
    if (!effects.empty()) out.effects(effects);
    if (!more.empty()) out.raw(more);
    return out.text;
  }
"""

PLAIN = {"number": "double", "whole": "std::uint32_t", "flag": "bool", "text": "std::string", "point": "SkinPoint"}
LISTS = {"vertices": "std::array<double, 3>", "triangles": "std::array<std::uint32_t, 3>", "numbers": "double"}
ARRAYS = {"pair": "std::array<double, 2>", "triple": "std::array<double, 3>", "wholes": "std::array<std::uint32_t, 2>"}


def is_enum(kind: str) -> bool:
    return kind == "SampleType" or any(kind == each.name for each in ENUMERATIONS)


def literal(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)


def initial(member: Member) -> str:
    """Its default as C++ writes it."""
    if member.kind in ARRAYS:
        return "{" + ", ".join(literal(v) for v in member.default) + "}"
    return f"{member.kind}::{member.default}" if is_enum(member.kind) else literal(member.default)


def declaration(member: Member) -> str:
    name, kind = member.name, member.kind
    if member.item or kind in LISTS:
        item = LISTS.get(kind) or PLAIN.get(member.item, member.item)
        return f"std::vector<{item}> {name}"
    if kind in ARRAYS:
        return f"{ARRAYS[kind]} {name}{initial(member)}"
    of = PLAIN.get(kind, kind)
    if member.default is None:
        return f"std::optional<{of}> {name}" if kind in ("number", "whole") or is_enum(kind) else f"{of} {name}"
    return f"{of} {name} = {initial(member)}"


def fields(structure: Structure) -> list[str]:
    lines = []
    for member in structure.members:
        lines += [f"/// {member.doc}", declaration(member) + ";"]
    return lines


def visits(structure: Structure) -> list[str]:
    out = []
    for member in structure.members:
        value = f"self.{member.name}"
        if member.name in structure.flat:
            out.append(f"{member.kind}::visit({value}, out);")
        elif structure is HELLO and not member.item and member.default is not None:
            out.append(f'out.unless("{member.key}", {value}, {ARRAYS.get(member.kind, "")}{initial(member)});')
        elif structure is HELLO and member.name == "effects":
            continue
        elif member.item and (member.default is None or structure is HELLO):
            out.append(f'out.unless_empty("{member.key}", {value});')
        elif member.kind == "text" and member.default is None:
            out.append(f'out.unless_empty("{member.key}", {value});')
        else:
            out.append(f'out("{member.key}", {value});')
    return out


def type_of(structure: Structure) -> str:
    lines = [f"/// {structure.doc}", f"struct {structure.name} {{"]
    lines += ["  " + line for line in fields(structure)]
    if structure.base:
        lines.append(f'  static constexpr const char* name = "{structure.tag}";')
    calls = visits(structure)
    if structure is HELLO:
        lines += ["  /// Members that this client does not know, as JSON without braces.", "  std::string more;"]
    if structure.name == "PointsEffect":
        lines += ["  /// The parameter is the list itself.",
                  "  template <class Self, class Out>", "  static void visit(Self& self, Out& out) {", "    out.list(self.points);", "  }"]
    elif calls:
        lines += ["  template <class Self, class Out>", "  static void visit(Self& self, Out& out) {",
                  *("    " + call for call in calls), "  }"]
    if structure is HELLO:
        lines += TEXT.rstrip("\n").split("\n")
    return "\n".join(lines) + "\n};\n"


def enumeration(each: Enumeration) -> str:
    quoted = ", ".join(f'"{w}"' for w in each.words)
    count = len(each.words)
    return (f"/// {each.doc}\nenum class {each.name} {{ {', '.join(each.words)} }};\n"
            f"constexpr std::array<const char*, {count}> words_of({each.name}) {{ return {{{quoted}}}; }}\n")


def variant(name: str, doc: str, members: tuple[Structure, ...], other: str, first: str = "") -> str:
    return f"/// {doc}\nusing {name} = std::variant<{first}{', '.join(s.name for s in members)}, {other}>;\n"


def text() -> str:
    union = SHAPES[-1]
    blocks = [HEAD, *(enumeration(each) for each in ENUMERATIONS), *(type_of(s) for s in SHAPES[:-1])]
    blocks += [OTHER_SHAPE, "struct UnionPart;\n", type_of(union),
               variant("Shape", "A shape of an object. Lengths are in mm, above 0 and at most 1000 unless a member says otherwise.", SHAPES, "OtherShape", "std::monostate, "),
               type_of(PART), *(type_of(s) for s in CONTACT), POINT, *(type_of(s) for s in PARAMETERS), *(type_of(s) for s in EFFECTS), OTHER_EFFECT,
               variant("Effect", "What the service computes beside the map, because the hello names it.", EFFECTS, "OtherEffect"),
               type_of(HELLO)]
    return "\n".join(blocks) + "\n}  // namespace papilla\n"
