using System;

namespace Papilla
{
    /// <summary>An answer was asked for what its session does not carry.</summary>
    public sealed class NotCarriedException : InvalidOperationException
    {
        internal NotCarriedException(string what, string why) : base("the answer carries no " + what + ": " + why) { }
    }

    /// <summary>
    /// How wrong an answer is likely to be, by what it shows: relative errors against finite elements. Half of such
    /// answers err less than the median, nine of ten less than P90. What is not stated is infinite.
    /// </summary>
    public struct ErrorEstimate
    {
        /// <summary>Of the map of SED (relative L2).</summary>
        public float SedMedian, SedP90;
        /// <summary>Of the size of the force that contact found.</summary>
        public float ForceMedian, ForceP90;

        /// <summary>Nothing is stated.</summary>
        public static readonly ErrorEstimate Unknown = new ErrorEstimate
        {
            SedMedian = float.PositiveInfinity, SedP90 = float.PositiveInfinity,
            ForceMedian = float.PositiveInfinity, ForceP90 = float.PositiveInfinity,
        };
    }

    /// <summary>A unit fired: its number in ready's <c>units</c>, and when, by the client's clock.</summary>
    public struct Spike
    {
        public ushort Unit;
        public long TimeUs;
    }

    /// <summary>
    /// What became of a frame. Its memory is made once and used again: copy what has to stay. <see cref="Map"/> and the
    /// other sections are those of a frame whose <see cref="Status"/> is Ok.
    /// </summary>
    public sealed class Answer
    {
        public Status Status;
        public uint Sequence;
        /// <summary>What was wrong with a frame of status Error.</summary>
        public Problem Problem;
        /// <summary>SED, J/m3: 224 x 224, row-major; 0 outside the window.</summary>
        public readonly float[] Map = new float[Wire.MapLength];
        /// <summary>Whether the answer carries a map; <see cref="Map"/> is 0 without.</summary>
        public bool HasMap;
        /// <summary>Firing rates, Hz: a whole map or a value a vertex; null without the effect <c>afferents</c>.</summary>
        public float[] Rates;
        /// <summary>Firing rates at the points, Hz, of the effects <c>points</c> and <c>afferents</c>: the first PointCount; null without.</summary>
        public float[] PointRatesHz;
        /// <summary>The window of the map that came.</summary>
        public int Column, Row, Width, Height;
        /// <summary>The sixteen numbers of the effect <c>summary</c>; force (N) and contact area (mm2) come first.</summary>
        public readonly float[] Summary = new float[16];
        /// <summary>Values of the effects <c>points</c> and <c>actuators</c>: the first PointCount and ActuatorCount.</summary>
        public readonly float[] Points = new float[1024];
        public readonly float[] Actuators = new float[1024];
        public int PointCount, ActuatorCount;
        public bool HasSummary, OutOfRange, NoContact;
        /// <summary>The frame told that nobody knows where things are (<see cref="Session.SendNotTracked"/>): all is zero.</summary>
        public bool NotTracked;
        /// <summary>The client's clock ticks so coarsely, or counts ms or ns, that rates and spikes may be far off.</summary>
        public bool CoarseClock;
        /// <summary>How wrong this answer is likely to be.</summary>
        public ErrorEstimate ErrorEstimate = ErrorEstimate.Unknown;
        /// <summary>What pushes back: of poses and of gaps.</summary>
        public Touch Touch;
        public bool HasTouch;
        /// <summary>The pressure that was found (Pa), a map or a value a vertex; null where the hello does not ask for it.</summary>
        public float[] PressurePa;
        /// <summary>The traction along the skin (Pa), x y z a vertex in the finger's frame; null where the hello does not ask for it.</summary>
        public float[] ShearPa;
        /// <summary>How far the skin has moved (mm), x y z a vertex in the finger's frame; null where the hello does not ask for it.</summary>
        public float[] DisplacementMm;
        /// <summary>Who fired since the answer before, in the order of time: the first SpikeCount; null without the effect <c>spikes</c>.</summary>
        public Spike[] Spikes;
        public int SpikeCount;
        /// <summary>Spikes of the finger since the hello, those too that no answer carried; modulo 2^32.</summary>
        public uint SpikesTotal;
        /// <summary>SED at the atlas' vertices, J/m3; null where the hello does not ask for it in place of the map.</summary>
        public float[] Vertices;
        /// <summary>The finger of the frame.</summary>
        public int Finger;
        /// <summary>The contact solve did not settle: its answer is rough.</summary>
        public bool Unsettled;
        /// <summary>The map is rougher or heavier than any the tier was trained on: its answer may mean nothing.</summary>
        public bool Unfamiliar;
        /// <summary>The contact reaches the edge of the atlas; what lies beyond is missing.</summary>
        public bool CutOff;
        public ulong ClientTimeUs;
        public long RoundTripUs;
        public uint TotalUs, QueueUs, InferUs;
        public int TierNumber;

        /// <summary>SED, J/m3: the map, or the values at the vertices. <see cref="NotCarriedException"/> where the answer has neither.</summary>
        public float[] Sed
        {
            get
            {
                if (Status == Status.Ok && HasMap) return Map;
                if (Status == Status.Ok && Vertices != null) return Vertices;
                throw new NotCarriedException("SED", Status == Status.Ok ? "the hello asks for no map" : "the frame is " + Status);
            }
        }

        /// <summary>Firing rates, Hz, where SED is. <see cref="NotCarriedException"/> where the answer has none.</summary>
        public float[] RatesHz
        {
            get
            {
                if (Status == Status.Ok && Rates != null) return Rates;
                throw new NotCarriedException("rates", Status == Status.Ok ? "name the effect 'afferents' in the hello" : "the frame is " + Status);
            }
        }

        /// <summary>Reads a message; a fault is a FormatException that says what is wrong.</summary>
        internal unsafe void Read(byte[] message, int bytes, Ready terms)
        {
            fixed (byte* m = message)
            {
                Status = (Status)m[7];
                Sequence = *(uint*)(m + 8);
                Problem = null;
                if (m[5] != 2) throw new FormatException("an answer is of kind " + m[5]);
                ClientTimeUs = *(ulong*)(m + 16);
                TotalUs = *(uint*)(m + 24);
                QueueUs = *(uint*)(m + 36);
                InferUs = *(uint*)(m + 40);
                TierNumber = *(ushort*)(m + 44);
                Finger = m[47];
                OutOfRange = (m[46] & Wire.FlagOutOfRange) != 0;
                NoContact = (m[46] & Wire.FlagNoContact) != 0;
                Unfamiliar = (m[46] & Wire.FlagUnfamiliar) != 0;
                CutOff = (m[46] & Wire.FlagCutOff) != 0;
                Unsettled = (m[46] & Wire.FlagUnsettled) != 0;
                HasMap = false;
                NotTracked = (m[46] & Wire.FlagNotTracked) != 0;
                CoarseClock = (m[46] & Wire.FlagCoarseClock) != 0;
                if (Status != Status.Ok) return;
                Clear();
                ReadContact(m, bytes, terms);
                HasSummary = Copy(m, terms.SummaryAt, 16, bytes, Summary);
                PointCount = Copy(m, terms.PointsAt, terms.PointsCount, bytes, Points) ? terms.PointsCount : 0;
                PointRatesHz = Sized(PointRatesHz, terms.PointRatesCount);
                Copy(m, terms.PointRatesAt, terms.PointRatesCount, bytes, PointRatesHz);
                ReadRates(m, bytes, terms);
                ReadSpikes(m, bytes, terms);
                ActuatorCount = Copy(m, terms.ActuatorsAt, terms.ActuatorsCount, bytes, Actuators) ? terms.ActuatorsCount : 0;
                HasMap = terms.MapAt >= 0;
                if (HasMap) ReadMap(m, bytes, terms.MapAt);
            }
        }

        internal static unsafe uint PeekSequence(byte[] message, int bytes)
        {
            if (bytes < Wire.HeaderBytes) throw new FormatException("an answer of " + bytes + " bytes has no header");
            fixed (byte* m = message)
            {
                if (*(uint*)m != Wire.Magic || m[4] != Wire.Version) throw new FormatException("an answer does not start with PPL1 and version " + Wire.Version);
                return *(uint*)(m + 8);
            }
        }

        unsafe void ReadContact(byte* m, int bytes, Ready terms)
        {
            if (Finger >= Session.FingersMax) throw new FormatException("an answer to finger " + Finger);
            HasTouch = terms.TouchAt >= 0;
            int touchEnd = HasTouch ? terms.TouchAt + sizeof(Touch) : 0;
            if (touchEnd > bytes || terms.VerticesAt + terms.VerticesBytes > bytes) throw Short(bytes);
            if (HasTouch) Touch = *(Touch*)(m + terms.TouchAt);
            bool isEstimated = terms.ErrorEstimateAt >= 0;
            if (isEstimated && terms.ErrorEstimateAt + sizeof(ErrorEstimate) > bytes) throw Short(bytes);
            ErrorEstimate = isEstimated ? *(ErrorEstimate*)(m + terms.ErrorEstimateAt) : ErrorEstimate.Unknown;
            PressurePa = Sized(PressurePa, terms.PressureCount);
            Copy(m, terms.PressureAt, terms.PressureCount, bytes, PressurePa);
            ShearPa = Sized(ShearPa, terms.ShearCount);
            Copy(m, terms.ShearAt, terms.ShearCount, bytes, ShearPa);
            DisplacementMm = Sized(DisplacementMm, terms.DisplacementCount);
            Copy(m, terms.DisplacementAt, terms.DisplacementCount, bytes, DisplacementMm);
            var type = (SampleType)m[6];
            Vertices = Sized(Vertices, type > SampleType.U8 ? 0 : terms.VerticesBytes / Wire.Bytes(type));
            if (Vertices == null) return;
            fixed (float* to = Vertices) Wire.Decode(m + terms.VerticesAt, Vertices.Length, type, *(float*)(m + 28), to);
        }

        unsafe void ReadRates(byte* m, int bytes, Ready terms)
        {
            var type = (SampleType)m[6];
            int room = terms.RatesBytes - Wire.RatesHeadBytes;
            Rates = Sized(Rates, type > SampleType.U8 || room < 0 ? 0 : room / Wire.Bytes(type));
            if (Rates == null) return;
            if (terms.RatesAt + terms.RatesBytes > bytes) throw Short(bytes);
            byte* from = m + terms.RatesAt;
            fixed (float* to = Rates) Wire.Decode(from + Wire.RatesHeadBytes, Rates.Length, type, *(float*)from, to);
        }

        /// <summary>Two numbers, then for each spike its unit and how long before the frame it was, us.</summary>
        unsafe void ReadSpikes(byte* m, int bytes, Ready terms)
        {
            SpikeCount = 0;
            SpikesTotal = 0;
            if (terms.SpikesAt < 0)
            {
                Spikes = null;
                return;
            }
            if (terms.SpikesAt + terms.SpikesBytes > bytes) throw Short(bytes);
            int most = (terms.SpikesBytes - SpikesHeadBytes) / SpikeBytes;
            if (Spikes == null || Spikes.Length != most) Spikes = new Spike[most];
            byte* from = m + terms.SpikesAt;
            uint count = *(uint*)(from + 4);
            if (count > most) throw new FormatException("an answer names " + count + " spikes, and has room for " + most);
            SpikesTotal = *(uint*)from;
            SpikeCount = (int)count;
            for (int k = 0; k < SpikeCount; k++)
            {
                ushort* one = (ushort*)(from + SpikesHeadBytes + SpikeBytes * k);
                Spikes[k] = new Spike { Unit = one[0], TimeUs = (long)ClientTimeUs - one[1] };
            }
        }

        const int SpikesHeadBytes = 8, SpikeBytes = 4;

        /// <summary>Memory for so many values, the same where it fits; null for none.</summary>
        static float[] Sized(float[] values, int count)
        {
            if (count == 0) return null;
            return values != null && values.Length == count ? values : new float[count];
        }

        static FormatException Short(int bytes)
        {
            return new FormatException("an answer of " + bytes + " bytes ends before its sections");
        }

        static unsafe bool Copy(byte* m, int at, int count, int bytes, float[] to)
        {
            if (at < 0) return false;
            if (at + 4 * count > bytes) throw Short(bytes);
            for (int k = 0; k < count; k++) to[k] = ((float*)(m + at))[k];
            return true;
        }

        unsafe void ReadMap(byte* m, int bytes, int at)
        {
            int width = *(ushort*)(m + 12), height = *(ushort*)(m + 14), column = *(ushort*)(m + 32), row = *(ushort*)(m + 34);
            var type = (SampleType)m[6];
            if (type > SampleType.U8 || at + width * height * Wire.Bytes(type) != bytes || column + width > Wire.SidePx || row + height > Wire.SidePx)
            {
                throw new FormatException("an answer of " + bytes + " bytes is no map of " + width + " x " + height + " at " + column + ", " + row);
            }
            Width = width;
            Height = height;
            Column = column;
            Row = row;
            fixed (float* map = Map)
            {
                for (int y = 0; y < height; y++)
                {
                    Wire.Decode(m + at + y * width * Wire.Bytes(type), width, type, *(float*)(m + 28), map + (row + y) * Wire.SidePx + column);
                }
            }
        }

        /// <summary>Only what the last answer wrote has to go.</summary>
        void Clear()
        {
            for (int y = Row; y < Row + Height; y++) Array.Clear(Map, y * Wire.SidePx + Column, Width);
            Width = Height = Column = Row = 0;
        }
    }
}
