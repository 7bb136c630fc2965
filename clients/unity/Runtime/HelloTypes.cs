// Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
using System;
using System.Collections.Generic;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>What the frames of a session hold.</summary>
    public enum FrameInput
    {
        Pressure, Objects, Gaps,
    }

    /// <summary>The places of samples: the pixels of the map, or the vertices of the atlas.</summary>
    public enum SampleLayout
    {
        Map, Vertices,
    }

    /// <summary>What happens to pressure beyond the training of the tier: it is reduced, or sent on and flagged, or the frame is refused.</summary>
    public enum OutOfRangeRule
    {
        Clamp, Flag, Refuse,
    }

    /// <summary>How the service finds the pressure from objects or gaps, from accurate to fast.</summary>
    public enum ContactMethod
    {
        Pixels, CoarsePixels, SecondOrder, SmallStrain, Springs,
    }

    /// <summary>What drives the actuators: SED (J/m3), or firing rates (Hz).</summary>
    public enum ActuatorInput
    {
        Sed, Sa1Rate,
    }

    /// <summary>How intensities are computed: each actuator by itself, or all pins fitted together, or that and corrected once by the network.</summary>
    public enum ActuatorDrive
    {
        Formula, Fitted, Corrected,
    }

    /// <summary>Class of a simulated nerve fibre: slowly adapting, rapidly adapting, Pacinian.</summary>
    public enum UnitClass
    {
        Sa1, Ra, Pc,
    }

    /// <summary>Tissue whose measured creep is used.</summary>
    public enum Tissue
    {
        Subcutaneous, Skin,
    }

    /// <summary>Which stiffness the training of the tier had: that right after a step, or that after a long time.</summary>
    public enum Moduli
    {
        Instantaneous, LongTerm,
    }

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

        static readonly string[] FrameInputWords = { "pressure", "objects", "gaps" };

        internal static string Of(FrameInput value) { return FrameInputWords[(int)value]; }

        static readonly string[] SampleLayoutWords = { "map", "vertices" };

        internal static string Of(SampleLayout value) { return SampleLayoutWords[(int)value]; }

        static readonly string[] OutOfRangeRuleWords = { "clamp", "flag", "refuse" };

        internal static string Of(OutOfRangeRule value) { return OutOfRangeRuleWords[(int)value]; }

        static readonly string[] ContactMethodWords = { "pixels", "coarse_pixels", "second_order", "small_strain", "springs" };

        internal static string Of(ContactMethod value) { return ContactMethodWords[(int)value]; }

        static readonly string[] ActuatorInputWords = { "sed", "sa1_rate" };

        internal static string Of(ActuatorInput value) { return ActuatorInputWords[(int)value]; }

        static readonly string[] ActuatorDriveWords = { "formula", "fitted", "corrected" };

        internal static string Of(ActuatorDrive value) { return ActuatorDriveWords[(int)value]; }

        static readonly string[] UnitClassWords = { "sa1", "ra", "pc" };

        internal static string Of(UnitClass value) { return UnitClassWords[(int)value]; }

        static readonly string[] TissueWords = { "subcutaneous", "skin" };

        internal static string Of(Tissue value) { return TissueWords[(int)value]; }

        static readonly string[] ModuliWords = { "instantaneous", "long_term" };

        internal static string Of(Moduli value) { return ModuliWords[(int)value]; }

        static readonly string[] SampleTypeWords = { "f32", "f16", "u16", "u8" };

        internal static string Of(SampleType value) { return SampleTypeWords[(int)value]; }
    }

    /// <summary>A flat plate with rounded edges, 4 mm and twice the edge radius thick. Its origin is its middle.</summary>
    public sealed class PlateShape : Shape
    {
        /// <summary>Side lengths along x and y, mm.</summary>
        public double[] SizeMm = { 20, 20 };
        /// <summary>Radius of its edges, mm: 0 to half the shorter side.</summary>
        public double EdgeRadiusMm = 1;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "plate" };
            json["size_mm"] = Words.Of(SizeMm);
            json["edge_radius_mm"] = EdgeRadiusMm;
            return json;
        }
    }

    /// <summary>A ball. Its origin is its centre.</summary>
    public sealed class SphereShape : Shape
    {
        /// <summary>Radius, mm.</summary>
        public double RadiusMm = 5;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "sphere" };
            json["radius_mm"] = RadiusMm;
            return json;
        }
    }

    /// <summary>A bar that lies along its y, with rounded ends. Its origin is the middle of its axis.</summary>
    public sealed class CylinderShape : Shape
    {
        /// <summary>Radius, mm.</summary>
        public double RadiusMm = 3;
        /// <summary>Length with its rounded ends, mm.</summary>
        public double LengthMm = 30;
        /// <summary>Rounds the ends, mm: at most the radius; equal to it they are half spheres.</summary>
        public double EndRadiusMm = 1;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "cylinder" };
            json["radius_mm"] = RadiusMm;
            json["length_mm"] = LengthMm;
            json["end_radius_mm"] = EndRadiusMm;
            return json;
        }
    }

    /// <summary>A blunt wedge along its y. Its origin is the middle of its tip.</summary>
    public sealed class WedgeShape : Shape
    {
        /// <summary>Width at the tip, mm, before its edges are rounded.</summary>
        public double TipWidthMm = 0.05;
        /// <summary>Width at the base, mm, before its edges are rounded: at least that at the tip.</summary>
        public double BaseWidthMm = 1;
        /// <summary>Height, mm.</summary>
        public double HeightMm = 2;
        /// <summary>Radius of all edges, mm.</summary>
        public double TipRadiusMm = 0.02;
        /// <summary>Length along y, mm.</summary>
        public double LengthMm = 30;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "wedge" };
            json["tip_width_mm"] = TipWidthMm;
            json["base_width_mm"] = BaseWidthMm;
            json["height_mm"] = HeightMm;
            json["tip_radius_mm"] = TipRadiusMm;
            json["length_mm"] = LengthMm;
            return json;
        }
    }

    /// <summary>An upright cylinder with a flat end. Its origin is the middle of that end.</summary>
    public sealed class PunchShape : Shape
    {
        /// <summary>Outer radius, mm.</summary>
        public double RadiusMm = 3;
        /// <summary>Rounds the rim, mm: at most the radius and half the height.</summary>
        public double RimRadiusMm = 0.25;
        /// <summary>Height, mm.</summary>
        public double HeightMm = 6;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "punch" };
            json["radius_mm"] = RadiusMm;
            json["rim_radius_mm"] = RimRadiusMm;
            json["height_mm"] = HeightMm;
            return json;
        }
    }

    /// <summary>The end of an upright tube. Its origin is the middle of that end.</summary>
    public sealed class RingShape : Shape
    {
        /// <summary>Outer radius, mm.</summary>
        public double OuterRadiusMm = 4;
        /// <summary>Radius of the hole, mm: below the outer radius.</summary>
        public double InnerRadiusMm = 3;
        /// <summary>Rounds all four rims, mm: at most half the wall and half the height.</summary>
        public double RimRadiusMm = 0.25;
        /// <summary>Height, mm.</summary>
        public double HeightMm = 6;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "ring" };
            json["outer_radius_mm"] = OuterRadiusMm;
            json["inner_radius_mm"] = InnerRadiusMm;
            json["rim_radius_mm"] = RimRadiusMm;
            json["height_mm"] = HeightMm;
            return json;
        }
    }

    /// <summary>A box with rounded edges. Its origin is its middle.</summary>
    public sealed class BoxShape : Shape
    {
        /// <summary>Side lengths along x, y and z, mm.</summary>
        public double[] SizeMm = { 10, 10, 10 };
        /// <summary>Radius of its edges, mm: above 0, at most half the shortest side.</summary>
        public double EdgeRadiusMm = 1;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "box" };
            json["size_mm"] = Words.Of(SizeMm);
            json["edge_radius_mm"] = EdgeRadiusMm;
            return json;
        }
    }

    /// <summary>A bar that lies along its y and ends in half balls. Its origin is its middle.</summary>
    public sealed class CapsuleShape : Shape
    {
        /// <summary>Radius, mm.</summary>
        public double RadiusMm = 3;
        /// <summary>Length with both half balls, mm: at least twice the radius.</summary>
        public double LengthMm = 20;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "capsule" };
            json["radius_mm"] = RadiusMm;
            json["length_mm"] = LengthMm;
            return json;
        }
    }

    /// <summary>A ring of round section that lies flat, its hole along its z. Its origin is its middle.</summary>
    public sealed class TorusShape : Shape
    {
        /// <summary>Radius of the circle in the middle of the tube, mm.</summary>
        public double RadiusMm = 4;
        /// <summary>Radius of the tube, mm: below that of the circle.</summary>
        public double TubeRadiusMm = 1;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "torus" };
            json["radius_mm"] = RadiusMm;
            json["tube_radius_mm"] = TubeRadiusMm;
            return json;
        }
    }

    /// <summary>Ridges along y on a base. Its origin lies in the plane of their tops, in the middle.</summary>
    public sealed class GratingShape : Shape
    {
        /// <summary>Number of ridges: 1 to 1000.</summary>
        public int Ridges = 5;
        /// <summary>Width of a ridge, mm.</summary>
        public double RidgeMm = 1.5;
        /// <summary>Width of a groove, mm.</summary>
        public double GrooveMm = 1.5;
        /// <summary>Depth of the grooves, mm.</summary>
        public double HeightMm = 1.5;
        /// <summary>Radius of all edges, mm: at most half a ridge, half the length and 2 mm.</summary>
        public double EdgeRadiusMm = 0.25;
        /// <summary>Length along y, mm.</summary>
        public double LengthMm = 20;

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "grating" };
            json["ridges"] = Ridges;
            json["ridge_mm"] = RidgeMm;
            json["groove_mm"] = GrooveMm;
            json["height_mm"] = HeightMm;
            json["edge_radius_mm"] = EdgeRadiusMm;
            json["length_mm"] = LengthMm;
            return json;
        }
    }

    /// <summary>Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle.</summary>
    public sealed class DotsShape : Shape
    {
        /// <summary>Dots along x and y: 1 to 1000 each.</summary>
        public int[] Count = { 3, 2 };
        /// <summary>Distance of neighbours, mm: at least the width of a dot.</summary>
        public double PitchMm = 2.34;
        /// <summary>Width of a dot where it meets the plate, mm.</summary>
        public double BaseMm = 1.44;
        /// <summary>Height of a dot, mm: at most half its width.</summary>
        public double HeightMm = 0.48;
        /// <summary>Side lengths of the plate, mm; it has to hold the dots and 1 mm around them.</summary>
        public double[] PlateMm = { 20, 20 };

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "dots" };
            json["count"] = Words.Of(Count);
            json["pitch_mm"] = PitchMm;
            json["base_mm"] = BaseMm;
            json["height_mm"] = HeightMm;
            json["plate_mm"] = Words.Of(PlateMm);
            return json;
        }
    }

    /// <summary>A surface of listed heights. Its origin is the middle of the grid.</summary>
    public sealed class HeightmapShape : Shape
    {
        /// <summary>Number of heights along x: 2 or more.</summary>
        public int Columns = 2;
        /// <summary>Distance between neighbouring heights along x and y, mm.</summary>
        public double[] PixelMm = { 0.1, 0.1 };
        /// <summary>Heights above the origin, mm, row by row from the lowest y; two rows or more.</summary>
        public float[] HeightsMm = new float[0];

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "heightmap" };
            json["columns"] = Columns;
            json["pixel_mm"] = Words.Of(PixelMm);
            json["heights_mm"] = Words.Of(HeightsMm, value => (JToken)value);
            return json;
        }
    }

    /// <summary>A mesh of at most 16 384 triangles. Its origin is that of its vertices. The service mends one that is not closed, and says so.</summary>
    public sealed class MeshShape : Shape
    {
        /// <summary>x, y, z of each vertex, mm.</summary>
        public float[] VerticesMm = new float[0];
        /// <summary>Three vertices for each triangle, counter-clockwise as seen from outside.</summary>
        public int[] Triangles = new int[0];

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "mesh" };
            json["vertices_mm"] = Words.Threes(VerticesMm, value => (JToken)value);
            json["triangles"] = Words.Threes(Triangles, value => (JToken)value);
            return json;
        }
    }

    /// <summary>Parts that move as one body.</summary>
    public sealed class UnionShape : Shape
    {
        /// <summary>The parts, 1 to 64.</summary>
        public readonly List<UnionPart> Parts = new List<UnionPart>();

        internal override JObject ToJson()
        {
            var json = new JObject { ["shape"] = "union" };
            json["parts"] = Words.Of(Parts, one => (JToken)one.ToJson());
            return json;
        }
    }

    /// <summary>A part of a union, moved and turned in the union's axes.</summary>
    [Serializable]
    public sealed class UnionPart
    {
        /// <summary>What it is: any shape but a union.</summary>
        public Shape Part;
        /// <summary>Where its own origin lies, mm.</summary>
        public double[] AtMm = { 0, 0, 0 };
        /// <summary>Turn about the union's z, degrees: the first of the three.</summary>
        public double YawDeg;
        /// <summary>Turn about the union's y, degrees. A height map has to leave it 0.</summary>
        public double PitchDeg;
        /// <summary>Turn about the union's x, degrees. A height map has to leave it 0.</summary>
        public double RollDeg;

        internal JObject ToJson()
        {
            var json = new JObject();
            json["part"] = Words.Of(Part);
            json["at_mm"] = Words.Of(AtMm);
            json["yaw_deg"] = YawDeg;
            json["pitch_deg"] = PitchDeg;
            json["roll_deg"] = RollDeg;
            return json;
        }
    }

    /// <summary>What an object is made of, as far as the skin feels it.</summary>
    [Serializable]
    public sealed class TouchMaterial
    {
        /// <summary>The pressure that pushes its surface in by 1 mm, MPa/mm: above 0. Left out: it is rigid.</summary>
        public double? StiffnessMpaPerMm;
        /// <summary>Coulomb's coefficient of friction with the skin: 0 to 10.</summary>
        public double Friction;

        internal void Write(JObject json)
        {
            if (StiffnessMpaPerMm != null) json["stiffness_mpa_per_mm"] = StiffnessMpaPerMm.Value;
            json["friction"] = Friction;
        }
    }

    /// <summary>An object that can be touched; each frame gives its pose.</summary>
    [Serializable]
    public sealed class TouchObject
    {
        /// <summary>Its shape, and its size in millimetres.</summary>
        public Shape Shape;
        /// <summary>What it is made of; by default rigid and without friction.</summary>
        public TouchMaterial Material = new TouchMaterial();

        internal JObject ToJson()
        {
            var json = new JObject();
            json["shape"] = Words.Of(Shape);
            Material.Write(json);
            return json;
        }
    }

    /// <summary>A finger of the session.</summary>
    [Serializable]
    public sealed class TouchFinger
    {
        /// <summary>Which of the service's fingers it is, as GET /v1/fingers lists them. Left out: the default finger.</summary>
        public string Name;
        /// <summary>Its width divided by that of the finger of this name: 0.25 to 4.</summary>
        public double Width = 1;
        /// <summary>Stiffness of its tissue divided by that of the finger of this name: 0.25 to 4.</summary>
        public double Stiffness = 1;

        internal JObject ToJson()
        {
            var json = new JObject();
            if (Name != null) json["name"] = Name;
            json["width"] = Width;
            json["stiffness"] = Stiffness;
            return json;
        }
    }

    /// <summary>An actuator of a tactile display.</summary>
    [Serializable]
    public sealed class Actuator
    {
        /// <summary>Its place on the finger.</summary>
        public SkinPoint At;
        /// <summary>Radius of what it averages over, or of its pin, mm. Left out: that of the effect.</summary>
        public double? RadiusMm;
        /// <summary>Intensity for each unit of the input above the threshold. Left out: that of the effect.</summary>
        public double? Gain;
        /// <summary>Input below which the intensity is 0. Left out: that of the effect.</summary>
        public double? Threshold;

        internal JObject ToJson()
        {
            var json = new JObject();
            json["at"] = At.ToJson();
            if (RadiusMm != null) json["radius_mm"] = RadiusMm.Value;
            if (Gain != null) json["gain"] = Gain.Value;
            if (Threshold != null) json["threshold"] = Threshold.Value;
            return json;
        }
    }

    /// <summary>A simulated nerve fibre.</summary>
    [Serializable]
    public sealed class NerveUnit
    {
        /// <summary>Its class.</summary>
        public UnitClass UnitClass = UnitClass.Sa1;
        /// <summary>Its place on the finger.</summary>
        public SkinPoint At;
        /// <summary>Which of TouchSim's neurons of the class: 0 to 3, for ra 0 to 8.</summary>
        public int Model;

        internal JObject ToJson()
        {
            var json = new JObject();
            json["class"] = Words.Of(UnitClass);
            json["at"] = At.ToJson();
            json["model"] = Model;
            return json;
        }
    }

    /// <summary>A term of a Prony series.</summary>
    [Serializable]
    public sealed class PronyTerm
    {
        /// <summary>Share of the modulus that relaxes: above 0; all together at most 0.99.</summary>
        public double G;
        /// <summary>Its time constant, s.</summary>
        public double TauS = 1;

        internal JObject ToJson()
        {
            var json = new JObject();
            json["g"] = G;
            json["tau_s"] = TauS;
            return json;
        }
    }

    /// <summary>Answers carry a summary: force, contact area and fourteen other numbers.</summary>
    public sealed class SummaryEffect : Effect
    {
        internal override string Name { get { return "summary"; } }

        internal override JToken Parameters() { return null; }
    }

    /// <summary>Answers carry SED at points of the finger.</summary>
    public sealed class PointsEffect : Effect
    {
        /// <summary>The points, 1 to 1024.</summary>
        public readonly List<SkinPoint> Points = new List<SkinPoint>();

        public PointsEffect(params SkinPoint[] points) { Points.AddRange(points); }

        internal override string Name { get { return "points"; } }

        internal override JToken Parameters() { return Words.Of(Points, one => (JToken)one.ToJson()); }
    }

    /// <summary>Answers carry firing rates of slowly adapting nerve fibres, Hz.</summary>
    public sealed class AfferentsEffect : Effect
    {
        /// <summary>Elastic modulus of the dermis, kPa.</summary>
        public double ERefKpa = 80;
        /// <summary>Threshold, kPa.</summary>
        public double ThetaKpa = 8;
        /// <summary>Static sensitivity, Hz/kPa.</summary>
        public double KSHzPerKpa = 1;
        /// <summary>Dynamic sensitivity, Hz s/kPa.</summary>
        public double KDHzSPerKpa = 0.2;
        /// <summary>False: no map of rates; points, summary and actuators still use them.</summary>
        public bool Map = true;

        internal override string Name { get { return "afferents"; } }

        internal override JToken Parameters()
        {
            var json = new JObject();
            json["e_ref_kpa"] = ERefKpa;
            json["theta_kpa"] = ThetaKpa;
            json["k_s_hz_per_kpa"] = KSHzPerKpa;
            json["k_d_hz_s_per_kpa"] = KDHzSPerKpa;
            json["map"] = Map;
            return json;
        }
    }

    /// <summary>Answers carry when simulated nerve fibres fired.</summary>
    public sealed class SpikesEffect : Effect
    {
        /// <summary>Seed of the random places, of the models of units and of the noise.</summary>
        public int Seed = 1;
        /// <summary>Slowly adapting units for each cm2.</summary>
        public double Sa1PerCm2 = 70;
        /// <summary>Rapidly adapting units for each cm2.</summary>
        public double RaPerCm2 = 140;
        /// <summary>Pacinian units for each cm2.</summary>
        public double PcPerCm2 = 21;
        /// <summary>Units of your own in place of those at random, 1 to 4096.</summary>
        public readonly List<NerveUnit> Units = new List<NerveUnit>();
        /// <summary>Elastic modulus of the dermis, kPa.</summary>
        public double ERefKpa = 80;
        /// <summary>Whether noise is added to the membranes.</summary>
        public bool Noise;
        /// <summary>Most spikes in one answer: 1 to 16384.</summary>
        public int SpikesMax = 1024;

        internal override string Name { get { return "spikes"; } }

        internal override JToken Parameters()
        {
            var json = new JObject();
            json["seed"] = Seed;
            json["sa1_per_cm2"] = Sa1PerCm2;
            json["ra_per_cm2"] = RaPerCm2;
            json["pc_per_cm2"] = PcPerCm2;
            if (Units.Count > 0) json["units"] = Words.Of(Units, one => (JToken)one.ToJson());
            json["e_ref_kpa"] = ERefKpa;
            json["noise"] = Noise;
            json["spikes_max"] = SpikesMax;
            return json;
        }
    }

    /// <summary>Answers carry an intensity for each actuator of a tactile display.</summary>
    public sealed class ActuatorsEffect : Effect
    {
        /// <summary>The actuators, 1 to 1024.</summary>
        public readonly List<Actuator> Actuators = new List<Actuator>();
        /// <summary>Radius of what an actuator averages over, or of its pin, mm, where it has none of its own.</summary>
        public double? RadiusMm;
        /// <summary>Intensity for each unit of the input above the threshold, where an actuator has none of its own.</summary>
        public double? Gain;
        /// <summary>Input below which the intensity is 0, in its unit.</summary>
        public double Threshold;
        /// <summary>Greatest intensity.</summary>
        public double Max = 1;
        /// <summary>What drives them; firing rates need the effect afferents.</summary>
        public ActuatorInput Input = ActuatorInput.Sed;
        /// <summary>How intensities are computed.</summary>
        public ActuatorDrive Drive = ActuatorDrive.Formula;

        internal override string Name { get { return "actuators"; } }

        internal override JToken Parameters()
        {
            var json = new JObject();
            json["actuators"] = Words.Of(Actuators, one => (JToken)one.ToJson());
            if (RadiusMm != null) json["radius_mm"] = RadiusMm.Value;
            if (Gain != null) json["gain"] = Gain.Value;
            json["threshold"] = Threshold;
            json["max"] = Max;
            json["input"] = Words.Of(Input);
            json["drive"] = Words.Of(Drive);
            return json;
        }
    }

    /// <summary>The tissue creeps under a constant pressure.</summary>
    public sealed class RelaxationEffect : Effect
    {
        /// <summary>Whose creep it is.</summary>
        public Tissue Tissue = Tissue.Subcutaneous;
        /// <summary>A series of your own in place of the tissue's, one to six terms.</summary>
        public readonly List<PronyTerm> Prony = new List<PronyTerm>();
        /// <summary>Which stiffness the training had.</summary>
        public Moduli Moduli = Moduli.Instantaneous;

        internal override string Name { get { return "relaxation"; } }

        internal override JToken Parameters()
        {
            var json = new JObject();
            json["tissue"] = Words.Of(Tissue);
            if (Prony.Count > 0) json["prony"] = Words.Of(Prony, one => (JToken)one.ToJson());
            json["moduli"] = Words.Of(Moduli);
            return json;
        }
    }

    /// <summary>SED takes account of traction along the skin; needs friction.</summary>
    public sealed class ShearEnergyEffect : Effect
    {
        internal override string Name { get { return "shear_energy"; } }

        internal override JToken Parameters() { return null; }
    }

    /// <summary>The map is cut to the region in contact.</summary>
    public sealed class ContactWindowEffect : Effect
    {
        /// <summary>Margin around it, pixels.</summary>
        public int MarginPx = 24;

        internal override string Name { get { return "contact_window"; } }

        internal override JToken Parameters()
        {
            var json = new JObject();
            json["margin_px"] = MarginPx;
            return json;
        }
    }

    /// <content>What a session asks for. Members that are not set take the service's default: docs/reference/protocol-hello.md.</content>
    public sealed partial class Hello
    {
        /// <summary>What frames hold. Left out: objects if there are any in the hello, pressure if not.</summary>
        public FrameInput? Input;
        /// <summary>Places of the samples of pressure or gaps.</summary>
        public SampleLayout InputLayout = SampleLayout.Map;
        /// <summary>Type of the samples of frames. Poses are f32; gaps are f32 or f16.</summary>
        public SampleType SampleType = SampleType.F32;
        /// <summary>Pressure that one unit of a u16 or u8 sample stands for, Pa.</summary>
        public double? PressureScalePa;
        /// <summary>What happens to pressure beyond the training.</summary>
        public OutOfRangeRule OutOfRange = OutOfRangeRule.Clamp;
        /// <summary>Frames of pressure at vertices also hold the traction.</summary>
        public bool Traction;
        /// <summary>The objects, 1 to 16, whose poses frames hold.</summary>
        public readonly List<TouchObject> Objects = new List<TouchObject>();
        /// <summary>The fingers, 1 to 10. None: the default finger alone.</summary>
        public readonly List<TouchFinger> Fingers = new List<TouchFinger>();
        /// <summary>Each frame holds a net force with which the objects are to press.</summary>
        public bool ForceTarget;
        /// <summary>Coulomb's coefficient of friction of what gaps tell of: 0 to 10. Left out: none.</summary>
        public double? Friction;
        /// <summary>Frames of gaps also hold velocities, mm/s.</summary>
        public bool Velocity;
        /// <summary>A frame that was delayed for longer on its way is stale, us. Left out: none is.</summary>
        public int? StaleAfterUs;
        /// <summary>False: answers carry no SED at pixels or vertices.</summary>
        public bool Map = true;
        /// <summary>Places of the SED in answers.</summary>
        public SampleLayout AnswerLayout = SampleLayout.Map;
        /// <summary>Type of SED and firing rates in answers. Left out: that of frames.</summary>
        public SampleType? AnswerSampleType;
        /// <summary>Answers to objects and gaps carry the pressure that was found, Pa, at these places.</summary>
        public SampleLayout? Pressure;
        /// <summary>Answers to objects and gaps carry the traction along the skin, Pa, at the vertices.</summary>
        public bool Shear;
        /// <summary>Answers to objects and gaps carry how far the skin has moved, mm, at the vertices.</summary>
        public bool Displacement;
        /// <summary>Answers say how wrong they are likely to be.</summary>
        public bool ErrorEstimate;
        /// <summary>Answers to objects and gaps carry the local stiffness, N/mm.</summary>
        public bool Stiffness;
        /// <summary>What is computed beside the map; nothing else is.</summary>
        public readonly List<Effect> Effects = new List<Effect>();
        /// <summary>Pressure above which a pixel counts as in contact, Pa.</summary>
        public double ContactPa;
        /// <summary>A tier by its name. Left out: the service chooses, by the budget if there is one.</summary>
        public string Tier;
        /// <summary>Time that a frame may spend in the service, us. Left out: no deadline.</summary>
        public int? BudgetUs;
        /// <summary>How contact is solved. Left out: the most accurate method that can serve the hello.</summary>
        public ContactMethod? Method;
        /// <summary>Hash of the atlas that you draw with; the hello is refused if the tier has another.</summary>
        public string AtlasHash;

        void Write(JObject json)
        {
            if (Input != null) json["input"] = Words.Of(Input.Value);
            if (InputLayout != SampleLayout.Map) json["input_layout"] = Words.Of(InputLayout);
            if (SampleType != SampleType.F32) json["sample_type"] = Words.Of(SampleType);
            if (PressureScalePa != null) json["pressure_scale_pa"] = PressureScalePa.Value;
            if (OutOfRange != OutOfRangeRule.Clamp) json["out_of_range"] = Words.Of(OutOfRange);
            if (Traction) json["traction"] = Traction;
            if (Objects.Count > 0) json["objects"] = Words.Of(Objects, one => (JToken)one.ToJson());
            if (Fingers.Count > 0) json["fingers"] = Words.Of(Fingers, one => (JToken)one.ToJson());
            if (ForceTarget) json["force_target"] = ForceTarget;
            if (Friction != null) json["friction"] = Friction.Value;
            if (Velocity) json["velocity"] = Velocity;
            if (StaleAfterUs != null) json["stale_after_us"] = StaleAfterUs.Value;
            if (!Map) json["map"] = Map;
            if (AnswerLayout != SampleLayout.Map) json["answer_layout"] = Words.Of(AnswerLayout);
            if (AnswerSampleType != null) json["answer_sample_type"] = Words.Of(AnswerSampleType.Value);
            if (Pressure != null) json["pressure"] = Words.Of(Pressure.Value);
            if (Shear) json["shear"] = Shear;
            if (Displacement) json["displacement"] = Displacement;
            if (ErrorEstimate) json["error_estimate"] = ErrorEstimate;
            if (Stiffness) json["stiffness"] = Stiffness;
            if (ContactPa != 0) json["contact_pa"] = ContactPa;
            if (Tier != null) json["tier"] = Tier;
            if (BudgetUs != null) json["budget_us"] = BudgetUs.Value;
            if (Method != null) json["method"] = Words.Of(Method.Value);
            if (AtlasHash != null) json["atlas_hash"] = AtlasHash;
        }
    }
}
