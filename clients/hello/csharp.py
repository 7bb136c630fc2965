"""The C# form of a hello: clients/unity/Runtime/HelloTypes.cs."""

from members import ENUMERATIONS, HELLO, SAMPLE_TYPE, STRUCTURES, Enumeration, Member, Structure

HEAD = """// Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
using System;
using System.Collections.Generic;
using Newtonsoft.Json.Linq;

namespace Papilla
{"""

BASES = """
    /// <summary>A shape of an object. Lengths are in millimetres, above 0 and at most 1000 unless a member says otherwise.</summary>
    public abstract class Shape
    {
        internal abstract JObject ToJson();
    }

    /// <summary>A shape that this client does not know, as on the wire: <c>new OtherShape(new JObject { ["shape"] = "..." })</c>.</summary>
    public sealed class OtherShape : Shape
    {
        public readonly JObject Json;

        public OtherShape(JObject json) { Json = json; }

        internal override JObject ToJson() { return (JObject)Json.DeepClone(); }
    }

    /// <summary>What the service computes beside the map, because the hello names it.</summary>
    public abstract class Effect
    {
        internal abstract string Name { get; }

        /// <summary>The hello's member of that name; null: there is none.</summary>
        internal abstract JToken Parameters();
    }

    /// <summary>An effect that this client does not know, such as one of a tier, by its name; parameters as on the wire, or null.</summary>
    public sealed class OtherEffect : Effect
    {
        readonly string name;
        public JToken Json;

        public OtherEffect(string name, JToken json = null)
        {
            this.name = name;
            Json = json;
        }

        internal override string Name { get { return name; } }

        internal override JToken Parameters() { return Json == null ? null : Json.DeepClone(); }
    }

    /// <summary>A place on the finger.</summary>
    public struct SkinPoint
    {
        readonly string unit;
        readonly double x, y, z;

        SkinPoint(string unit, double x, double y, double z)
        {
            this.unit = unit;
            this.x = x;
            this.y = y;
            this.z = z;
        }

        /// <summary>The pixel nearest to a point of the undeformed finger, mm in the finger's frame; at most 2 mm off.</summary>
        public static SkinPoint Mm(double xMm, double yMm, double zMm) { return new SkinPoint("mm", xMm, yMm, zMm); }

        /// <summary>A point of the map, pixels; v down.</summary>
        public static SkinPoint Px(double uPx, double vPx) { return new SkinPoint("px", uPx, vPx, 0); }

        internal JObject ToJson()
        {
            return new JObject { [unit ?? "px"] = unit == "mm" ? new JArray(x, y, z) : new JArray(x, y) };
        }
    }

    /// <summary>How values stand on the wire.</summary>
    static class Words
    {
        internal static JArray Of<T>(IEnumerable<T> values, Func<T, JToken> word)
        {
            var array = new JArray();
            foreach (var value in values) array.Add(word(value));
            return array;
        }

        internal static JArray Of(double[] values)
        {
            return Of(values, value => (JToken)value);
        }

        internal static JArray Of(int[] values)
        {
            return Of(values, value => (JToken)value);
        }

        internal static JObject Of(Shape shape)
        {
            if (shape == null) throw new ArgumentException("an object, or a part of a union, has no shape: set its member of that name");
            return shape.ToJson();
        }

        /// <summary>Threes, one after the other.</summary>
        internal static JArray Threes<T>(T[] values, Func<T, JToken> word)
        {
            if (values.Length % 3 != 0) throw new ArgumentException("a mesh has three numbers for each vertex and each triangle, not " + values.Length + " in all");
            var array = new JArray();
            for (int k = 0; k < values.Length; k += 3) array.Add(new JArray(word(values[k]), word(values[k + 1]), word(values[k + 2])));
            return array;
        }
"""


def pascal(name: str) -> str:
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))


def is_enum(kind: str) -> bool:
    return kind == "SampleType" or any(kind == each.name for each in ENUMERATIONS)


def literal(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(int(value)) if isinstance(value, float) and value == int(value) else repr(value)


PLAIN = {"number": "double", "whole": "int", "flag": "bool", "text": "string", "point": "SkinPoint"}
ARRAYS = {"pair": "double[]", "triple": "double[]", "wholes": "int[]", "vertices": "float[]", "triangles": "int[]", "numbers": "float[]"}


def declaration(member: Member) -> str:
    name, kind, default = pascal(member.name), member.kind, member.default
    if member.item:
        item = PLAIN.get(member.item, member.item)
        return f"public readonly List<{item}> {name} = new List<{item}>();"
    if kind in ARRAYS:
        values = ", ".join(literal(v) for v in default)
        of = ARRAYS[kind]
        return f"public {of} {name} = " + (f"{{ {values} }};" if default else f"new {of[:-1]}0];")
    if kind in PLAIN:
        of = PLAIN[kind]
        if default is None:
            return f"public {of}{'?' if kind in ('number', 'whole') else ''} {name};"
        return f"public {of} {name}" + ("" if default in (0, False) and kind != "text" else f" = {literal(default)}") + ";"
    if is_enum(kind):
        return f"public {kind}? {name};" if default is None else f"public {kind} {name} = {kind}.{pascal(default)};"
    if kind == "Shape":
        return f"public Shape {name};"
    return f"public {kind} {name} = new {kind}();"


def word(kind: str, value: str) -> str:
    """The token of a value that is there."""
    if kind in ("number", "whole", "flag", "text"):
        return value
    if is_enum(kind):
        return f"Words.Of({value})"
    if kind in ("pair", "triple", "wholes"):
        return f"Words.Of({value})"
    if kind in ("vertices", "triangles"):
        return f"Words.Threes({value}, value => (JToken)value)"
    if kind == "numbers":
        return f"Words.Of({value}, value => (JToken)value)"
    if kind == "Shape":
        return f"Words.Of({value})"
    return f"{value}.ToJson()"


def token(member: Member) -> str:
    name = pascal(member.name)
    nullable = member.default is None and (member.kind in ("number", "whole") or is_enum(member.kind))
    if member.item:
        return f"Words.Of({name}, one => (JToken){word(member.item, 'one')})"
    return word(member.kind, f"{name}.Value" if nullable else name)


def condition(member: Member, says_all: bool) -> str:
    """When a member is said; empty: always."""
    name = pascal(member.name)
    if member.item:
        return f"{name}.Count > 0" if member.default is None or not says_all else ""
    if member.default is None and member.kind not in ("point", "Shape"):
        return f"{name} != null"
    if says_all or member.kind in ("point", "Shape"):
        return ""
    if is_enum(member.kind):
        return f"{name} != {member.kind}.{pascal(member.default)}"
    if member.kind == "flag":
        return f"!{name}" if member.default else name
    return f"{name} != {literal(member.default)}"


def setters(structure: Structure, says_all: bool) -> list[str]:
    lines = []
    for member in structure.members:
        if member.name in structure.flat:
            lines.append(f"{pascal(member.name)}.Write(json);")
            continue
        when = condition(member, says_all)
        lines.append((f"if ({when}) " if when else "") + f'json["{member.key}"] = {token(member)};')
    return lines


def fields(structure: Structure) -> list[str]:
    lines = []
    for member in structure.members:
        lines += [f"/// <summary>{member.doc}</summary>", declaration(member)]
    return lines


def body(structure: Structure, flat: set[str]) -> list[str]:
    if structure.base == "Effect":
        lines = [f'internal override string Name {{ get {{ return "{structure.tag}"; }} }}', ""]
        if not structure.members:
            return [*lines, "internal override JToken Parameters() { return null; }"]
        if structure.name == "PointsEffect":
            return [
                "public PointsEffect(params SkinPoint[] points) { Points.AddRange(points); }",
                "",
                *lines,
                f"internal override JToken Parameters() {{ return {token(structure.members[0])}; }}",
            ]
        return [*lines, "internal override JToken Parameters()", "{", "    var json = new JObject();",
                *("    " + line for line in setters(structure, True)), "    return json;", "}"]
    if structure.name in flat:
        return ["internal void Write(JObject json)", "{", *("    " + line for line in setters(structure, True)), "}"]
    first = f'    var json = new JObject {{ ["shape"] = "{structure.tag}" }};' if structure.base else "    var json = new JObject();"
    override = "override " if structure.base else ""
    return [f"internal {override}JObject ToJson()", "{", first, *("    " + line for line in setters(structure, True)), "    return json;", "}"]


def type_of(structure: Structure, flat: set[str]) -> list[str]:
    base = f" : {structure.base}" if structure.base else ""
    inner = fields(structure)
    lines = [f"/// <summary>{structure.doc}</summary>"]
    if not structure.base:
        lines.append("[Serializable]")
    lines += [f"public sealed class {structure.name}{base}", "{"]
    lines += ["    " + line for line in inner] + ([""] if inner else [])
    lines += [("    " + line).rstrip() for line in body(structure, flat)]
    return [*lines, "}"]


def enumeration(each: Enumeration) -> list[str]:
    return [f"/// <summary>{each.doc}</summary>", f"public enum {each.name}", "{", f"    {', '.join(pascal(w) for w in each.words)},", "}"]


def words() -> list[str]:
    lines = []
    for each in (*ENUMERATIONS, SAMPLE_TYPE):
        table = pascal(each.name) + "Words"
        quoted = ", ".join(f'"{w}"' for w in each.words)
        lines += ["", f"static readonly string[] {table} = {{ {quoted} }};", "",
                  f"internal static string Of({each.name} value) {{ return {table}[(int)value]; }}"]
    return lines


def text() -> str:
    flat = {m.kind for s in STRUCTURES for m in s.members if m.name in s.flat}
    out = [HEAD.rstrip("\n")]
    indent = lambda lines: "\n".join(("    " + line).rstrip() for line in lines)
    blocks = [indent(enumeration(each)) for each in ENUMERATIONS]
    blocks.append(BASES.strip("\n") + "\n" + "\n".join(("        " + line).rstrip() for line in words()) + "\n    }")
    blocks += [indent(type_of(each, flat)) for each in STRUCTURES]
    hello = [f"/// <content>{HELLO.doc} Members that are not set take the service's default: docs/reference/protocol-hello.md.</content>",
             "public sealed partial class Hello", "{", *("    " + line for line in fields(HELLO)), "",
             "    void Write(JObject json)", "    {",
             *("        " + line for line in setters(HELLO, False) if '"effects"' not in line), "    }", "}"]
    blocks.append(indent(hello))
    return "\n".join(out) + "\n" + "\n\n".join(blocks) + "\n}\n"
