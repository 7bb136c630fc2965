using System.Runtime.InteropServices;

namespace Papilla
{
    /// <summary>
    /// Where an object of the hello is in the finger's frame: its origin, mm, and its turn as a unit quaternion. As on the wire. Of
    /// places in Unity it is <see cref="FromUnity(Place, Place, double)"/>: the frame has other axes, and is right-handed.
    /// </summary>
    [StructLayout(LayoutKind.Sequential)]
    public partial struct Pose
    {
        public float XMm, YMm, ZMm, TurnX, TurnY, TurnZ, TurnW;

        public Pose(float xMm, float yMm, float zMm, float turnX = 0, float turnY = 0, float turnZ = 0, float turnW = 1)
        {
            XMm = xMm;
            YMm = yMm;
            ZMm = zMm;
            TurnX = turnX;
            TurnY = turnY;
            TurnZ = turnZ;
            TurnW = turnW;
        }
    }

    /// <summary>A net force to be met, in sessions whose hello says <c>force_target</c>: a unit vector and the force along it. As on the wire.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct NetForce
    {
        public float X, Y, Z, ForceN;
    }

    /// <summary>What pushes back on a finger, in its frame. As on the wire.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public partial struct Touch
    {
        public float ForceXN, ForceYN, ForceZN;
        /// <summary>Torque about the frame's origin.</summary>
        public float TorqueXNMm, TorqueYNMm, TorqueZNMm;
        /// <summary>Area in contact, of the deformed skin.</summary>
        public float AreaMm2;
        /// <summary>Centre of the pressure, on the deformed skin.</summary>
        public float CentreXMm, CentreYMm, CentreZMm;
        /// <summary>How deep the deepest vertex is left inside.</summary>
        public float PenetrationMm;
        /// <summary>Change of force for a small travel of the things along it; 0: not asked for.</summary>
        public float StiffnessNPerMm;
        /// <summary>How far the things travelled to meet the net force.</summary>
        public float TravelMm;
        public float PressureMaxPa;
        /// <summary>Share of the second order in the displacement.</summary>
        public float Share;
        public float SolveUs;
    }
}
