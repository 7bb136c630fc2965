using System;
using System.Runtime.InteropServices;

namespace Papilla
{
    /// <summary>What a frame came to, of a <see cref="NativeSession"/>. Its arrays are made once and used again.</summary>
    public sealed class NativeAnswer
    {
        /// <summary>SED, J/m3, row by row; the first Width x Height samples.</summary>
        public readonly float[] Map = new float[Wire.MapLength];
        /// <summary>The pixels of <see cref="Map"/>; nothing (0 x 0) where no map was asked for.</summary>
        public int Column, Row, Width, Height;
        public bool HasSed, OutOfRange, NoContact, Unfamiliar, Unsettled, CutOff, NotTracked, CoarseClock;
        /// <summary>How wrong this answer is likely to be.</summary>
        public ErrorEstimate ErrorEstimate = ErrorEstimate.Unknown;
        /// <summary>What pushes back: of poses and of gaps.</summary>
        public Touch Touch;
        public bool HasTouch;
        /// <summary>The sixteen numbers of the effect <c>summary</c>; empty without.</summary>
        public float[] Summary = new float[0];
        /// <summary>Firing rates (Hz), a whole map or at the vertices, and at the points: the effect <c>afferents</c>. Empty without.</summary>
        public float[] RatesHz = new float[0], PointRatesHz = new float[0];
        /// <summary>SED at the points; intensities of the actuators; the pressure that was found (Pa); SED at the vertices. Empty without.</summary>
        public float[] Points = new float[0], Actuators = new float[0], PressurePa = new float[0], Vertices = new float[0];

        internal unsafe void Take(ref NativeCalls.Answer from)
        {
            Column = (int)from.Column;
            Row = (int)from.Row;
            Width = (int)from.Width;
            Height = (int)from.Height;
            HasSed = from.HasSed != 0;
            OutOfRange = (from.Flags & 1) != 0;
            NoContact = (from.Flags & 2) != 0;
            Unfamiliar = (from.Flags & 4) != 0;
            Unsettled = (from.Flags & 8) != 0;
            CutOff = (from.Flags & 16) != 0;
            NotTracked = (from.Flags & 32) != 0;
            CoarseClock = (from.Flags & 64) != 0;
            if (from.Map.Count != UIntPtr.Zero) Marshal.Copy(from.Map.Data, Map, 0, (int)from.Map.Count);
            ErrorEstimate = from.ErrorEstimate == IntPtr.Zero ? ErrorEstimate.Unknown : *(ErrorEstimate*)from.ErrorEstimate;
            HasTouch = from.Touch != IntPtr.Zero;
            if (HasTouch) Touch = *(Touch*)from.Touch;
            Copy(from.Summary, from.Summary == IntPtr.Zero ? 0 : 16, ref Summary);
            Copy(from.RatesHz.Data, (int)from.RatesHz.Count, ref RatesHz);
            Copy(from.PointRatesHz.Data, (int)from.PointRatesHz.Count, ref PointRatesHz);
            Copy(from.Points.Data, (int)from.Points.Count, ref Points);
            Copy(from.Actuators.Data, (int)from.Actuators.Count, ref Actuators);
            Copy(from.PressurePa.Data, (int)from.PressurePa.Count, ref PressurePa);
            Copy(from.Vertices.Data, (int)from.Vertices.Count, ref Vertices);
        }

        static void Copy(IntPtr data, int count, ref float[] to)
        {
            if (to.Length != count) to = new float[count];
            if (count > 0) Marshal.Copy(data, to, 0, count);
        }
    }

    /// <summary>A folder of models, for programs that open no socket. Needs the native library <c>papilla_c</c>.</summary>
    public sealed class NativeModel : IDisposable
    {
        internal IntPtr Handle;
        public readonly string Name, AtlasHash;
        public readonly int VertexCount;
        /// <summary>x, y, z of each vertex of the skin, mm.</summary>
        public readonly float[] SkinMm;

        /// <param name="tier">null: the folder's default</param>
        /// <param name="contact">the contact model, for poses and gaps; null: none</param>
        public NativeModel(string folder, string tier = null, string contact = null)
        {
            if (NativeCalls.papilla_abi() != NativeCalls.Abi) throw new NotSupportedException("papilla_c has another interface than this client");
            Handle = NativeCalls.papilla_model_new();
            try
            {
                Must(NativeCalls.papilla_model_load(Handle, NativeCalls.Utf8(folder), NativeCalls.Utf8(tier), NativeCalls.Utf8(contact)));
                NativeCalls.ModelInfo info;
                Must(NativeCalls.papilla_model_info(Handle, out info));
                Name = NativeCalls.Text(info.Name);
                AtlasHash = NativeCalls.Text(info.AtlasHash);
                VertexCount = (int)info.VertexCount;
                SkinMm = new float[3 * VertexCount];
                Marshal.Copy(info.SkinMm, SkinMm, 0, SkinMm.Length);
            }
            catch
            {
                Dispose();
                throw;
            }
        }

        /// <summary>Draws values at the vertices of the skin as a map of 224 x 224.</summary>
        public void Rasterise(float[] values, float[] map)
        {
            if (map.Length != Wire.MapLength) throw new ArgumentException("a map has 224 x 224 samples", "map");
            Must(NativeCalls.papilla_model_rasterise(Handle, values, (UIntPtr)values.Length, map));
            GC.KeepAlive(this);
        }

        void Must(int status)
        {
            if (status != 0) throw NativeCalls.Refusal(status, NativeCalls.papilla_model_error(Handle), IntPtr.Zero);
        }

        public void Dispose()
        {
            NativeCalls.papilla_model_free(Handle);
            Handle = IntPtr.Zero;
            GC.SuppressFinalize(this);
        }

        ~NativeModel()
        {
            NativeCalls.papilla_model_free(Handle);
        }
    }

    /// <summary>One hand, inside this process: a frame is answered before the call returns. For one thread at a time.</summary>
    public sealed class NativeSession : IDisposable
    {
        IntPtr handle = NativeCalls.papilla_session_new();
        /// <summary>What the last frame came to.</summary>
        public readonly NativeAnswer Answer = new NativeAnswer();

        /// <param name="hello">members of the protocol's hello</param>
        public NativeSession(NativeModel model, Hello hello)
        {
            try
            {
                Open(model, hello);
            }
            catch
            {
                Dispose();
                throw;
            }
        }

        /// <summary>Opens the session anew. Refused, it goes on as it was.</summary>
        public void Open(NativeModel model, Hello hello)
        {
            Must(NativeCalls.papilla_session_open(handle, model.Handle, NativeCalls.Utf8(hello.ToText(false))));
            GC.KeepAlive(model);
        }

        /// <summary>Pressure, Pa: a map, or a value a vertex where the hello says so.</summary>
        public NativeAnswer Send(float[] pressurePa, ulong timeUs = 0, int finger = 0)
        {
            NativeCalls.Answer answer;
            Must(NativeCalls.papilla_send_map(handle, FingerOf(finger), pressurePa, (UIntPtr)pressurePa.Length, timeUs, out answer));
            return Taken(ref answer);
        }

        /// <summary>A pose of each object of the hello.</summary>
        public unsafe NativeAnswer SendPoses(Pose[] poses, ulong timeUs = 0, int finger = 0, NetForce? net = null)
        {
            NativeCalls.Answer answer;
            var force = net.GetValueOrDefault();
            var asked = net.HasValue ? (IntPtr)(&force) : IntPtr.Zero;
            Must(NativeCalls.papilla_send_poses(handle, FingerOf(finger), poses, (UIntPtr)poses.Length, asked, timeUs, out answer));
            return Taken(ref answer);
        }

        /// <summary>How deep the undeformed skin lies in things, mm: a map, or a value a vertex where the hello says so.</summary>
        public unsafe NativeAnswer SendGaps(float[] depthMm, ulong timeUs = 0, int finger = 0, NetForce? net = null)
        {
            NativeCalls.Answer answer;
            var force = net.GetValueOrDefault();
            var asked = net.HasValue ? (IntPtr)(&force) : IntPtr.Zero;
            Must(NativeCalls.papilla_send_gaps(handle, FingerOf(finger), depthMm, (UIntPtr)depthMm.Length, asked, timeUs, out answer));
            return Taken(ref answer);
        }

        /// <summary>Tracking is lost: the answer is zero, no unit fires, and what the session remembers waits for the next frame.</summary>
        public NativeAnswer SendNotTracked(ulong timeUs = 0, int finger = 0)
        {
            NativeCalls.Answer answer;
            Must(NativeCalls.papilla_send_not_tracked(handle, FingerOf(finger), timeUs, out answer));
            return Taken(ref answer);
        }

        /// <summary>How pressure is found, as <c>pixels</c>; empty where frames are pressure.</summary>
        public string Method { get { return NativeCalls.Text(NativeCalls.papilla_session_method(handle)); } }

        /// <summary>What the hello cannot have as one might expect, a line each; empty if there is nothing.</summary>
        public string Warning { get { return NativeCalls.Text(NativeCalls.papilla_session_warning(handle)); } }

        /// <summary>A number that a frame can hold.</summary>
        static byte FingerOf(int finger)
        {
            if (finger >= 0 && finger <= byte.MaxValue) return (byte)finger;
            throw new PapillaException(new Problem("bad_contact", "finger " + finger + " is none: a session has at most 10", "finger"));
        }

        NativeAnswer Taken(ref NativeCalls.Answer answer)
        {
            Answer.Take(ref answer);
            GC.KeepAlive(this);
            return Answer;
        }

        void Must(int status)
        {
            if (status == 0) return;
            throw NativeCalls.Refusal(status, NativeCalls.papilla_session_error(handle), NativeCalls.papilla_session_error_field(handle));
        }

        public void Dispose()
        {
            NativeCalls.papilla_session_free(handle);
            handle = IntPtr.Zero;
            GC.SuppressFinalize(this);
        }

        ~NativeSession()
        {
            NativeCalls.papilla_session_free(handle);
        }
    }
}
