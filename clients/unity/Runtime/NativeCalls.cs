using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Papilla
{
    /// <summary>clients/c/include/papilla_c.h, as it is.</summary>
    static class NativeCalls
    {
        /// <summary>PAPILLA_ABI of the header that this was written after.</summary>
        internal const uint Abi = 2;
        // In players for iOS and consoles the library is linked into the program.
#if (UNITY_IOS || UNITY_TVOS) && !UNITY_EDITOR
        const string Library = "__Internal";
#else
        const string Library = "papilla_c";
#endif

        [StructLayout(LayoutKind.Sequential)]
        internal struct Samples
        {
            internal IntPtr Data;
            internal UIntPtr Count;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct ModelInfo
        {
            internal IntPtr Name, AtlasHash;
            internal float PressureMaxPa, SedMaxJPerM3, MmPerPx;
            internal uint HasContact, VertexCount, TriangleCount;
            internal IntPtr Triangles, SkinMm, SkinUvPx, InterfaceMm, InterfaceUvPx;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Answer
        {
            internal uint Flags, HasSed, Column, Row, Width, Height;
            internal Samples Map, Vertices, PressurePa, RatesHz, Points, PointRatesHz, Actuators;
            internal IntPtr Summary, Touch, ErrorEstimate;
        }

        [DllImport(Library)] internal static extern uint papilla_abi();
        [DllImport(Library)] static extern IntPtr papilla_status_name(int status);
        [DllImport(Library)] internal static extern IntPtr papilla_model_new();
        [DllImport(Library)] internal static extern void papilla_model_free(IntPtr model);
        [DllImport(Library)] internal static extern IntPtr papilla_model_error(IntPtr model);
        [DllImport(Library)] internal static extern int papilla_model_load(IntPtr model, byte[] folder, byte[] tier, byte[] contact);
        [DllImport(Library)] internal static extern int papilla_model_info(IntPtr model, out ModelInfo info);
        [DllImport(Library)] internal static extern int papilla_model_rasterise(IntPtr model, float[] values, UIntPtr count, float[] map);
        [DllImport(Library)] internal static extern IntPtr papilla_session_new();
        [DllImport(Library)] internal static extern void papilla_session_free(IntPtr session);
        [DllImport(Library)] internal static extern IntPtr papilla_session_error(IntPtr session);
        [DllImport(Library)] internal static extern IntPtr papilla_session_error_field(IntPtr session);
        [DllImport(Library)] internal static extern int papilla_session_open(IntPtr session, IntPtr model, byte[] hello);
        [DllImport(Library)]
        internal static extern int papilla_send_map(IntPtr session, byte finger, float[] pressurePa, UIntPtr count, ulong timeUs, out Answer answer);
        [DllImport(Library)]
        internal static extern int papilla_send_poses(IntPtr session, byte finger, [In] Pose[] poses, UIntPtr count, IntPtr net, ulong timeUs, out Answer answer);
        [DllImport(Library)]
        internal static extern int papilla_send_gaps(IntPtr session, byte finger, float[] depthMm, UIntPtr count, IntPtr net, ulong timeUs, out Answer answer);

        [DllImport(Library)]
        internal static extern int papilla_send_not_tracked(IntPtr session, byte finger, ulong timeUs, out Answer answer);
        [DllImport(Library)] internal static extern IntPtr papilla_session_method(IntPtr session);
        [DllImport(Library)] internal static extern IntPtr papilla_session_warning(IntPtr session);

        /// <summary>A text of C; null stays null.</summary>
        internal static byte[] Utf8(string text)
        {
            return text == null ? null : Encoding.UTF8.GetBytes(text + "\0");
        }

        internal static string Text(IntPtr text)
        {
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) length++;
            var bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            return Encoding.UTF8.GetString(bytes);
        }

        internal static PapillaException Refusal(int status, IntPtr message, IntPtr field)
        {
            string member = field == IntPtr.Zero ? "" : Text(field);
            return new PapillaException(new Problem(Text(papilla_status_name(status)), Text(message), member.Length == 0 ? null : member));
        }
    }
}
