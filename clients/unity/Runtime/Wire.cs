using System;

namespace Papilla
{
    /// <summary>How a sample travels; the numbers are those of the wire.</summary>
    public enum SampleType : byte { F32 = 0, F16 = 1, U16 = 2, U8 = 3 }

    /// <summary>What became of a frame.</summary>
    public enum Status : byte { Ok = 0, Superseded = 1, Late = 2, Error = 3, Stale = 4, Lost = 255 }

    /// <summary>Sizes and samples of the protocol.</summary>
    public static class Wire
    {
        public const int SidePx = 224;
        public const int MapLength = SidePx * SidePx;
        public const int HeaderBytes = 48;
        public const int MessageBytesMax = 1 << 20;
        /// <summary>Objects of a session, and numbers of a pose or of a net force.</summary>
        public const int ObjectsMax = 16, RowLength = 7;

        internal const uint Magic = 0x314c5050;
        internal const byte Version = 3;
        internal const int FlagOutOfRange = 1, FlagNoContact = 2, FlagUnfamiliar = 4, FlagUnsettled = 8, FlagCutOff = 16, FlagNotTracked = 32, FlagCoarseClock = 64;
        /// <summary>Before the samples of the section <c>rates</c>: their scale, and zeros.</summary>
        internal const int RatesHeadBytes = 16;
        const float HalfMax = 65504;

        static readonly float[] Halves = HalfTable();

        /// <summary>Whether a message is what a session remembers, sealed: <c>PPS</c> and more.</summary>
        internal static bool IsSealed(byte[] message, int bytes)
        {
            return bytes > 3 && message[0] == 'P' && message[1] == 'P' && message[2] == 'S';
        }

        /// <summary>Bytes of one sample.</summary>
        public static int Bytes(SampleType type)
        {
            return type == SampleType.F32 ? 4 : type == SampleType.U8 ? 1 : 2;
        }

        /// <summary>Type of a name as a hello has it.</summary>
        public static SampleType Parse(string name)
        {
            switch (name)
            {
                case "f32": return SampleType.F32;
                case "f16": return SampleType.F16;
                case "u16": return SampleType.U16;
                case "u8": return SampleType.U8;
                default: throw new ArgumentException("'" + name + "' is no sample type; f32, f16, u16, u8 are", "name");
            }
        }

        /// <summary>Encodes a row of samples; integer types count units of 1 / <paramref name="unitsPerPa"/>.</summary>
        internal static unsafe void Encode(float* from, int count, SampleType type, double unitsPerPa, byte* to)
        {
            switch (type)
            {
                case SampleType.F32: for (int k = 0; k < count; k++) ((float*)to)[k] = from[k]; break;
                case SampleType.F16: for (int k = 0; k < count; k++) ((ushort*)to)[k] = ToHalf(from[k]); break;
                case SampleType.U16: for (int k = 0; k < count; k++) ((ushort*)to)[k] = (ushort)Unit(from[k] * unitsPerPa, 65535); break;
                default: for (int k = 0; k < count; k++) to[k] = (byte)Unit(from[k] * unitsPerPa, 255); break;
            }
        }

        /// <summary>Decodes a row of samples.</summary>
        internal static unsafe void Decode(byte* from, int count, SampleType type, float scale, float* to)
        {
            switch (type)
            {
                case SampleType.F32: for (int k = 0; k < count; k++) to[k] = ((float*)from)[k]; break;
                case SampleType.F16: for (int k = 0; k < count; k++) to[k] = Halves[((ushort*)from)[k]]; break;
                case SampleType.U16: for (int k = 0; k < count; k++) to[k] = ((ushort*)from)[k] * scale; break;
                default: for (int k = 0; k < count; k++) to[k] = from[k] * scale; break;
            }
        }

        static int Unit(double units, int most)
        {
            return units >= most ? most : units > 0 ? (int)(units + 0.5) : 0;
        }

        /// <summary>Bits of the nearest f16, ties to even, clamped to the greatest finite value.</summary>
        internal static unsafe ushort ToHalf(float value)
        {
            if (value > HalfMax) value = HalfMax;
            if (value < -HalfMax) value = -HalfMax;
            uint bits = *(uint*)&value;
            uint sign = bits >> 16 & 0x8000, exponent = bits >> 23 & 255, fraction = bits & 0x7fffff;
            if (exponent == 255) return (ushort)(sign | 0x7c00 | (fraction != 0 ? 0x200u : 0));
            if (exponent < 102) return (ushort)sign;
            // The smallest numbers are units of 2^-24.
            int shift = exponent >= 113 ? 13 : (int)(126 - exponent);
            uint whole = exponent >= 113 ? (exponent - 112) << 23 | fraction : fraction | 0x800000;
            uint kept = whole >> shift, rest = whole & (1u << shift) - 1, half = 1u << shift - 1;
            if (rest > half || rest == half && (kept & 1) != 0) kept++;
            return (ushort)(sign | kept);
        }

        static float[] HalfTable()
        {
            var table = new float[65536];
            for (int bits = 0; bits < table.Length; bits++)
            {
                int exponent = bits >> 10 & 31, fraction = bits & 1023;
                double value = exponent == 0 ? fraction * Math.Pow(2, -24) : (1 + fraction / 1024.0) * Math.Pow(2, exponent - 15);
                if (exponent == 31) value = fraction != 0 ? double.NaN : double.PositiveInfinity;
                table[bits] = (float)((bits & 0x8000) != 0 ? -value : value);
            }
            return table;
        }
    }
}
