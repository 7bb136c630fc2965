using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>
    /// What a session asks for, said in its first message. Members that are not set take the service's default, and so does
    /// what <see cref="Members"/> does not name.
    /// </summary>
    public sealed partial class Hello
    {
        /// <summary>Members that this client does not know, as on the wire; they are said last, and so replace those of the same name.</summary>
        public readonly JObject Members = new JObject();

        /// <summary>All members as on the wire, without type and version.</summary>
        public JObject ToJson()
        {
            var json = new JObject();
            if (Input == null && Objects.Count > 0) json["input"] = "objects";
            Write(json);
            if (Effects.Count > 0) json["effects"] = Words.Of(Effects, effect => (JToken)effect.Name);
            foreach (var effect in Effects)
            {
                var parameters = effect.Parameters();
                if (parameters != null) json[effect.Name] = parameters;
            }
            foreach (var member in Members) json[member.Key] = member.Value.DeepClone();
            return json;
        }

        /// <param name="follows">the session moves to another connection when it is asked to</param>
        /// <param name="resumes">what the service remembers is the next message</param>
        internal string ToText(bool follows, bool resumes = false)
        {
            var json = ToJson();
            json["type"] = "hello";
            json["version"] = Wire.Version;
            if (follows) json["reconnect"] = true;
            if (resumes) json["resume"] = true;
            return json.ToString(Newtonsoft.Json.Formatting.None);
        }
    }

    /// <summary>Terms of the session, as the server confirmed them.</summary>
    public sealed class Ready
    {
        public readonly string Tier;
        public readonly int TierNumber;
        public readonly long Session;
        public readonly string AtlasHash;
        public readonly long PredictedLatencyUs;
        /// <summary>Greatest pressure that the tier was trained on, Pa; what becomes of more the hello says (<c>out_of_range</c>).</summary>
        public readonly float PressureMaxPa;
        /// <summary>All members, as on the wire.</summary>
        public readonly JObject Json;
        internal readonly int ErrorEstimateAt = -1, TouchAt = -1, PressureAt = -1, PressureCount, ShearAt = -1, ShearCount, DisplacementAt = -1, DisplacementCount, SpikesAt = -1, SpikesBytes, VerticesAt = -1, VerticesBytes, RatesAt = -1, RatesBytes;
        internal readonly int SummaryAt = -1, PointsAt = -1, PointsCount, PointRatesAt = -1, PointRatesCount, ActuatorsAt = -1, ActuatorsCount, MapAt = -1;

        internal Ready(JObject json)
        {
            Json = json;
            Tier = (string)json["tier"];
            TierNumber = (int)json["tier_number"];
            Session = (long)json["session"];
            AtlasHash = (string)json["atlas_hash"];
            PredictedLatencyUs = (long)json["predicted_latency_us"];
            PressureMaxPa = (float)json["pressure_max_pa"];
            foreach (var section in json["sections"])
            {
                int at = (int)section["offset"], bytes = (int)section["bytes"];
                switch ((string)section["name"])
                {
                    case "touch": TouchAt = at; break;
                    case "pressure": PressureAt = at; PressureCount = bytes / 4; break;
                    case "shear": ShearAt = at; ShearCount = bytes / 4; break;
                    case "displacement": DisplacementAt = at; DisplacementCount = bytes / 4; break;
                    case "error_estimate": ErrorEstimateAt = at; break;
                    case "spikes": SpikesAt = at; SpikesBytes = bytes; break;
                    case "vertices": VerticesAt = at; VerticesBytes = bytes; break;
                    case "summary": SummaryAt = at; break;
                    case "rates": RatesAt = at; RatesBytes = bytes; break;
                    case "point_rates": PointRatesAt = at; PointRatesCount = bytes / 4; break;
                    case "points": PointsAt = at; PointsCount = bytes / 4; break;
                    case "actuators": ActuatorsAt = at; ActuatorsCount = bytes / 4; break;
                    case "map": MapAt = at; break;
                }
            }
        }
    }

    /// <summary>A refusal by the server.</summary>
    public sealed class Problem
    {
        public readonly string Code, Message, Field;
        internal readonly uint? Sequence;
        internal readonly bool Closes;

        internal Problem(JObject json)
        {
            Code = (string)json["code"];
            Message = (string)json["message"];
            Field = (string)json["field"];
            Sequence = (uint?)json["sequence"];
            Closes = (bool?)json["closes"] ?? false;
        }

        internal Problem(string code, string message, string field = null)
        {
            Code = code;
            Message = message;
            Field = field;
        }

        public override string ToString()
        {
            return Code + ": " + Message;
        }
    }

    /// <summary>A hello, a map or a request was refused.</summary>
    public sealed class PapillaException : System.Exception
    {
        public readonly Problem Problem;

        public PapillaException(Problem problem) : base(problem.ToString())
        {
            Problem = problem;
        }
    }
}
