"""The GDScript form of a hello, for Godot 3; clients/godot/generate makes that for Godot 4 of it."""

from members import ENUMERATIONS, HELLO, STRUCTURES, Member, Structure

HEAD = '''# Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
# What a session asks for, as types: docs/reference/protocol-hello.md. Members that are not set take the service's default.
#
#   var ball = Hello.TouchObject.new().with({"shape": Hello.ShapeSphere.new().with({"radius_mm": 10.0})})
#   session.hello = Hello.new().with({"objects": [ball], "map": false})
extends "res://addons/papilla/typed.gd"

const Typed = preload("res://addons/papilla/typed.gd")
'''

OTHERS = '''
# A shape that this client does not know: all its members, as on the wire.
class ShapeOther extends Typed:
	var json = {}
	func words():
		return json


# An effect that this client does not know, such as one of a tier: its name, and its parameters as on the wire; null: none.
class OtherEffect extends Typed:
	var name = ""
	var json = null
	func effect():
		return name
	func words():
		return json


# A place on the finger: `SkinPoint.new().with({"mm": Vector3(11.25, 0, -6.5)})`, or `"px": Vector2(112, 90)`.
class SkinPoint extends Typed:
	# The pixel nearest to this point of the undeformed finger, mm in the finger's frame; at most 2 mm off. Null: `px` it is.
	var mm = null
	# A point of the map, pixels; v down.
	var px = Vector2()
	func words():
		return {"px": plain(px)} if mm == null else {"mm": plain(mm)}
'''

TAIL = '''
# Members that this client does not know, as on the wire; they are said last.
var more = {}


# All members as on the wire, without type and version.
func words():
	var json = {}
%s
	if input == null and objects.size() > 0:
		json["input"] = "objects"
	if effects.size() > 0:
		json["effects"] = []
	for each in effects:
		json["effects"].append(each.effect())
		if each.words() != null:
			json[each.effect()] = each.words()
	for member in more:
		json[member] = more[member]
	return json
'''


def named(structure: Structure) -> str:
    """Godot has a SphereShape and a CylinderShape of its own: shapes are ShapeSphere, ShapeCylinder, ..."""
    return "Shape" + structure.name.removesuffix("Shape") if structure.base == "Shape" else structure.name


def is_enum(kind: str) -> bool:
    return kind == "SampleType" or any(kind == each.name for each in ENUMERATIONS)


def literal(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return "[" + ", ".join(literal(v) for v in value) + "]"
    return "null" if value is None else repr(value)


def choices(kind: str) -> str:
    words = next((each.words for each in ENUMERATIONS if each.name == kind), ("f32", "f16", "u16", "u8"))
    return " One of " + ", ".join(f'"{w}"' for w in words) + "."


def safe(name: str) -> str:
    """GDScript has functions of the names `max` and `seed`."""
    return {"max": "intensity_max", "seed": "random_seed"}.get(name, name)


def declaration(member: Member) -> list[str]:
    doc = member.doc.replace("Left out:", "Null:")
    if member.item:
        return [f"# {doc}", f"var {member.name} = []"]
    if member.kind == "TouchMaterial":
        return [f"# {doc}", f"var {member.name} = TouchMaterial.new()"]
    if is_enum(member.kind):
        doc += choices(member.kind)
    if member.kind in ("vertices", "triangles"):
        doc += " Vector3s, or arrays of three."
    return [f"# {doc}", f"var {safe(member.name)} = {literal(member.default)}"]


def setters(structure: Structure, says_all: bool) -> list[str]:
    lines = []
    for member in structure.members:
        value = f"plain({safe(member.name)})"
        if member.name == "effects" and structure is HELLO:
            continue
        if member.name in structure.flat:
            lines += [f"var {member.name}_words = {member.name}.words()", f"for key in {member.name}_words:", f"\tjson[key] = {member.name}_words[key]"]
            continue
        if member.item and (member.default is None or not says_all):
            when = f"{member.name}.size() > 0"
        elif member.default is None and member.kind not in ("point", "Shape"):
            when = f"{member.name} != null"
        elif not says_all and not member.item:
            when = {True: f"not {member.name}", False: member.name}.get(member.default) if member.kind == "flag" else f"{member.name} != {literal(member.default)}"
        else:
            when = ""
        line = f'json["{member.key}"] = {value}'
        lines += [f"if {when}:", "\t" + line] if when else [line]
    return lines


def type_of(structure: Structure) -> str:
    lines = [f"# {structure.doc}", f"class {named(structure)} extends Typed:"]
    for member in structure.members:
        lines += ["\t" + line for line in declaration(member)]
    if structure.base == "Effect":
        lines += ["\tfunc effect():", f'\t\treturn "{structure.tag}"']
    lines.append("\tfunc words():")
    if structure.base == "Effect" and not structure.members:
        lines.append("\t\treturn null")
    elif structure.name == "PointsEffect":
        lines.append("\t\treturn plain(points)")
    else:
        first = f'{{"shape": "{structure.tag}"}}' if structure.base == "Shape" else "{}"
        lines += [f"\t\tvar json = {first}", *("\t\t" + line for line in setters(structure, True)), "\t\treturn json"]
    return "\n" + "\n".join(lines) + "\n"


def text() -> str:
    blocks = [HEAD]
    fields = "\n".join(line for member in HELLO.members for line in declaration(member))
    says = "\n".join("\t" + line for line in setters(HELLO, False))
    blocks.append("\n" + fields + TAIL % says)
    blocks += [type_of(each) for each in STRUCTURES]
    blocks.append(OTHERS)
    return "\n".join(blocks)
