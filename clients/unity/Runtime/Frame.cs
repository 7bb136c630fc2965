using System;

namespace Papilla
{
    /// <summary>A request whose buffer is made once and filled anew for every frame.</summary>
    sealed class Frame
    {
        internal readonly byte[] Buffer = new byte[Headroom.Bytes + Wire.HeaderBytes + 4 * (Wire.MapLength + Wire.RowLength)];
        internal int Bytes;
        internal uint Sequence;
        const byte KindPressure = 1, KindObjects = 4, KindGaps = 5;

        /// <summary>
        /// Encodes a window; sample (x, y) is <c>values[first + y * stride + x]</c>. A scale of 0 is chosen so that the
        /// greatest pressure is the greatest unit.
        /// </summary>
        internal unsafe void Encode(float[] values, int first, int stride, int column, int row, int width, int height, SampleType type, float scale)
        {
            int sampleBytes = Wire.Bytes(type), most = type == SampleType.U16 ? 65535 : 255;
            Bytes = Wire.HeaderBytes + width * height * sampleBytes;
            fixed (float* from = values)
            fixed (byte* start = Buffer)
            {
                if (type < SampleType.U16) scale = 1;
                else if (!(scale > 0)) scale = Greatest(from + first, stride, width, height) / most;
                if (!(scale > 0)) scale = 1;
                byte* m = start + Headroom.Bytes;
                PutHeader(m, KindPressure, type, width, height, scale, 0);
                *(ushort*)(m + 32) = (ushort)column;
                *(ushort*)(m + 34) = (ushort)row;
                for (int y = 0; y < height; y++)
                {
                    Wire.Encode(from + first + y * stride, width, type, 1.0 / scale, m + Wire.HeaderBytes + y * width * sampleBytes);
                }
            }
        }

        /// <summary>That nobody knows where things are: a header alone, whose kind and sample type mean nothing.</summary>
        internal unsafe void EncodeNotTracked(int finger)
        {
            Bytes = Wire.HeaderBytes;
            fixed (byte* start = Buffer)
            {
                byte* m = start + Headroom.Bytes;
                PutHeader(m, KindPressure, SampleType.F32, 0, 0, 1, finger);
                m[46] = Wire.FlagNotTracked;
            }
        }

        internal unsafe void EncodePoses(Pose[] poses, int finger, NetForce? net)
        {
            int rows = poses.Length + (net == null ? 0 : 1);
            Bytes = Wire.HeaderBytes + 4 * Wire.RowLength * rows;
            fixed (byte* start = Buffer)
            {
                byte* m = start + Headroom.Bytes;
                PutHeader(m, KindObjects, SampleType.F32, Wire.RowLength, rows, 1, finger);
                for (int k = 0; k < poses.Length; k++) ((Pose*)(m + Wire.HeaderBytes))[k] = poses[k];
                PutNet(m + Wire.HeaderBytes + poses.Length * sizeof(Pose), net);
            }
        }

        internal unsafe void EncodeGaps(float[] depthMm, int finger, NetForce? net)
        {
            bool isMap = depthMm.Length == Wire.MapLength;
            Bytes = Wire.HeaderBytes + 4 * (depthMm.Length + (net == null ? 0 : Wire.RowLength));
            fixed (byte* start = Buffer)
            {
                byte* m = start + Headroom.Bytes;
                PutHeader(m, KindGaps, SampleType.F32, isMap ? Wire.SidePx : depthMm.Length, isMap ? Wire.SidePx : 1, 1, finger);
                for (int k = 0; k < depthMm.Length; k++) ((float*)(m + Wire.HeaderBytes))[k] = depthMm[k];
                PutNet(m + Wire.HeaderBytes + 4 * depthMm.Length, net);
            }
        }

        static unsafe void PutHeader(byte* m, byte kind, SampleType type, int width, int height, float scale, int finger)
        {
            for (int k = 0; k < Wire.HeaderBytes; k++) m[k] = 0;
            *(uint*)m = Wire.Magic;
            m[4] = Wire.Version;
            m[5] = kind;
            m[6] = (byte)type;
            *(ushort*)(m + 12) = (ushort)width;
            *(ushort*)(m + 14) = (ushort)height;
            *(float*)(m + 28) = scale;
            m[47] = (byte)finger;
        }

        static unsafe void PutNet(byte* m, NetForce? net)
        {
            if (net == null) return;
            var row = (float*)m;
            for (int k = 0; k < Wire.RowLength; k++) row[k] = 0;
            *(NetForce*)m = net.Value;
        }

        internal unsafe void Stamp(uint sequence, ulong timeUs, uint deadlineUs)
        {
            Sequence = sequence;
            fixed (byte* start = Buffer)
            {
                byte* m = start + Headroom.Bytes;
                *(uint*)(m + 8) = sequence;
                *(ulong*)(m + 16) = timeUs;
                *(uint*)(m + 24) = deadlineUs;
            }
        }

        static unsafe float Greatest(float* from, int stride, int width, int height)
        {
            float most = 0;
            for (int y = 0; y < height; y++)
            {
                for (int x = 0; x < width; x++) if (from[y * stride + x] > most) most = from[y * stride + x];
            }
            return most;
        }
    }
}
