using System;
using System.Collections;
using System.Linq;
using System.Reflection;
using Newtonsoft.Json.Linq;
using Papilla;

/// <summary>A case's hello built from the client's types, member by member: one that they lack fails the case, and so does one that they say otherwise.</summary>
static class TypedHello
{
    internal static Hello Of(JObject json)
    {
        var hello = new Hello();
        var names = (json["effects"] ?? new JArray()).Select(name => (string)name).ToArray();
        foreach (var member in json)
        {
            if (member.Key != "effects" && !names.Contains(member.Key)) Set(hello, member.Key, member.Value);
        }
        foreach (string name in names) hello.Effects.Add(EffectOf(name, json[name]));
        Holds("hello", json, hello.ToJson());
        return hello;
    }

    static Effect EffectOf(string name, JToken parameters)
    {
        var type = typeof(Effect).Assembly.GetType("Papilla." + Pascal(name) + "Effect");
        // A case without its parameters asks for a refusal.
        if (type == null || name == "actuators" && parameters == null) return new OtherEffect(name);
        if (name == "points") return new PointsEffect(parameters.Select(PointOf).ToArray());
        return (Effect)Filled(Activator.CreateInstance(type), (JObject)parameters ?? new JObject());
    }

    static object Filled(object of, JObject json)
    {
        foreach (var member in json) Set(of, member.Key, member.Value);
        return of;
    }

    static void Set(object of, string key, JToken value)
    {
        var field = of.GetType().GetField(Pascal(key));
        var material = of.GetType().GetField("Material");
        if (field == null && material != null)
        {
            Set(material.GetValue(of), key, value);
            return;
        }
        if (field == null) throw new Missed("no member " + key + " in " + of.GetType().Name);
        var list = field.GetValue(of) as IList;
        if (list == null || list.IsFixedSize)
        {
            field.SetValue(of, ValueOf(field.FieldType, value));
            return;
        }
        var item = field.FieldType.GetGenericArguments()[0];
        foreach (var one in value) list.Add(ValueOf(item, one));
    }

    static object ValueOf(Type type, JToken value)
    {
        type = Nullable.GetUnderlyingType(type) ?? type;
        if (type == typeof(SkinPoint)) return PointOf(value);
        if (type == typeof(Shape)) return ShapeOf((JObject)value);
        if (type.IsEnum) return Enum.Parse(type, Pascal((string)value));
        if (type.IsArray)
        {
            var flat = value.SelectMany(one => one.Type == JTokenType.Array ? one.ToArray() : new[] { one }).ToArray();
            var array = Array.CreateInstance(type.GetElementType(), flat.Length);
            for (int k = 0; k < flat.Length; k++) array.SetValue(ValueOf(type.GetElementType(), flat[k]), k);
            return array;
        }
        if (value.Type == JTokenType.Object) return Filled(Activator.CreateInstance(type), (JObject)value);
        return Convert.ChangeType(((JValue)value).Value, type, System.Globalization.CultureInfo.InvariantCulture);
    }

    static Shape ShapeOf(JObject json)
    {
        var type = typeof(Shape).Assembly.GetType("Papilla." + Pascal((string)json["shape"]) + "Shape");
        if (type == null) throw new Missed("no shape " + json["shape"]);
        var shape = (Shape)Activator.CreateInstance(type);
        foreach (var member in json) if (member.Key != "shape") Set(shape, member.Key, member.Value);
        return shape;
    }

    static SkinPoint PointOf(JToken at)
    {
        if (at["px"] != null) return SkinPoint.Px((double)at["px"][0], (double)at["px"][1]);
        return SkinPoint.Mm((double)at["mm"][0], (double)at["mm"][1], (double)at["mm"][2]);
    }

    static string Pascal(string name)
    {
        return string.Concat(name.Split('_').Select(part => part.Substring(0, 1).ToUpperInvariant() + part.Substring(1)).ToArray());
    }

    /// <summary>All that is due is there; what is left out is a default.</summary>
    static void Holds(string where, JToken due, JToken found)
    {
        if (found == null)
        {
            if (!IsDefault(where, due)) throw new Missed(where + " is not said");
        }
        else if (due.Type == JTokenType.Object)
        {
            foreach (var member in (JObject)due) Holds(where + "." + member.Key, member.Value, found[member.Key]);
        }
        else if (due.Type == JTokenType.Array)
        {
            if (due.Count() != found.Count()) throw new Missed(where + " has " + found.Count());
            for (int k = 0; k < due.Count(); k++) Holds(where + "[" + k + "]", due[k], found[k]);
        }
        else if (due.Type == JTokenType.Float || due.Type == JTokenType.Integer)
        {
            if (Math.Abs((double)due - (double)found) > 1e-6 * Math.Abs((double)due)) throw new Missed(where + " is " + found);
        }
        else if (!JToken.DeepEquals(due, found))
        {
            throw new Missed(where + " is " + found);
        }
    }

    static bool IsDefault(string where, JToken due)
    {
        if (where == "hello.sample_type") return (string)due == "f32";
        return where == "hello.out_of_range" && (string)due == "clamp";
    }
}
