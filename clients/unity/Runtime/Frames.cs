using System;

namespace Papilla
{
    /// <summary>
    /// Where a body is in Unity's world: position in metres, rotation as a quaternion. Of a finger: forward (z) points to the tip, up (y)
    /// out of the nail, the origin is the foremost point of the skin.
    /// </summary>
    public struct Place
    {
        public double X, Y, Z, TurnX, TurnY, TurnZ, TurnW;

        public Place(double x, double y, double z, double turnX = 0, double turnY = 0, double turnZ = 0, double turnW = 1)
        {
            X = x;
            Y = y;
            Z = z;
            TurnX = turnX;
            TurnY = turnY;
            TurnZ = turnZ;
            TurnW = turnW;
        }

        /// <summary>
        /// The finger of two tracked joints, as XR Hands gives them: that of the distal phalanx (<c>IndexDistal</c>) and the tip
        /// (<c>IndexTip</c>). It points from the one to the other, its nail the way of the distal joint's up (y). The tip's joint is the
        /// frame's origin, or lies <paramref name="insideMm"/> behind it. Left and right hands are the same: the model's finger is symmetric.
        /// </summary>
        /// <exception cref="PapillaException">a joint is no place, both are the same, or up points along the finger</exception>
        public static Place FingerOfJoints(Place distal, Place tip, double insideMm = 0)
        {
            distal = distal.Checked("distal");
            tip = tip.Checked("tip");
            double[] ahead = { tip.X - distal.X, tip.Y - distal.Y, tip.Z - distal.Z };
            double length = Frames.Length(ahead);
            if (!(length * Frames.MmPerUnit >= 1)) throw Frames.Refused("distal and tip are the same place");
            double[] up = Frames.Turned(distal, 1, new double[] { 0, 1, 0 });
            double along = 0;
            for (int k = 0; k < 3; k++) ahead[k] /= length;
            for (int k = 0; k < 3; k++) along += up[k] * ahead[k];
            for (int k = 0; k < 3; k++) up[k] -= along * ahead[k];
            double size = Frames.Length(up);
            if (!(size >= 1e-3)) throw Frames.Refused("the distal joint's up points along the finger");
            for (int k = 0; k < 3; k++) up[k] /= size;
            double back = insideMm / Frames.MmPerUnit;
            var finger = Frames.Looking(ahead, up);
            finger.X = tip.X + back * ahead[0];
            finger.Y = tip.Y + back * ahead[1];
            finger.Z = tip.Z + back * ahead[2];
            return finger;
        }

        /// <summary>With a quaternion of length one.</summary>
        internal Place Checked(string what)
        {
            double size = Math.Sqrt(TurnX * TurnX + TurnY * TurnY + TurnZ * TurnZ + TurnW * TurnW), sum = X + Y + Z;
            if (double.IsNaN(sum) || double.IsInfinity(sum) || double.IsNaN(size) || double.IsInfinity(size)) throw Frames.Refused(what + ": a number is not finite; while the hand is not tracked call SendNotTracked");
            if (size < 1e-6) throw Frames.Refused(what + ": the quaternion is zero; while the hand is not tracked call SendNotTracked");
            return new Place(X, Y, Z, TurnX / size, TurnY / size, TurnZ / size, TurnW / size);
        }
    }

    /// <summary>What pushes back on the finger, in Unity's world; an object feels the opposite.</summary>
    public struct Felt
    {
        /// <summary>N, for <c>AddForceAtPosition</c>.</summary>
        public double ForceX, ForceY, ForceZ;
        /// <summary>N m about the finger's origin, for <c>AddTorque</c>.</summary>
        public double TorqueX, TorqueY, TorqueZ;
        /// <summary>Centre of the pressure, in the world.</summary>
        public double X, Y, Z;
    }

    // Unity is left-handed: x right, y up, z ahead, metres. The finger's frame: x back, y right, z up, mm (docs/reference/frames-and-units.md).
    public partial struct Pose
    {
        /// <summary>
        /// Where an object is in the finger's frame. Both places are of the same world; <paramref name="scale"/> says how many times as large
        /// as life all is drawn.
        /// </summary>
        /// <exception cref="PapillaException">a number is not finite, a quaternion zero, a scale not above 0</exception>
        public static Pose FromUnity(Place finger, Place body, double scale = 1)
        {
            Frames.CheckScale(scale);
            finger = finger.Checked("finger");
            body = body.Checked("object");
            var at = Frames.Turned(finger, -1, new[] { body.X - finger.X, body.Y - finger.Y, body.Z - finger.Z });
            // Hamilton's product of the finger's turn, backwards, and the object's.
            double ax = -finger.TurnX, ay = -finger.TurnY, az = -finger.TurnZ, aw = finger.TurnW;
            double x = aw * body.TurnX + body.TurnW * ax + ay * body.TurnZ - az * body.TurnY;
            double y = aw * body.TurnY + body.TurnW * ay + az * body.TurnX - ax * body.TurnZ;
            double z = aw * body.TurnZ + body.TurnW * az + ax * body.TurnY - ay * body.TurnX;
            double w = aw * body.TurnW - ax * body.TurnX - ay * body.TurnY - az * body.TurnZ;
            double mm = Frames.MmPerUnit / scale;
            // A turn's axis is mirrored with the axes, and its sense once more.
            return new Pose((float)(-mm * at[2]), (float)(mm * at[0]), (float)(mm * at[1]), (float)z, (float)-x, (float)-y, (float)w);
        }
    }

    public partial struct Touch
    {
        /// <summary>What pushes back on the finger, in Unity's world.</summary>
        /// <exception cref="PapillaException">as of <see cref="Pose.FromUnity(Place, Place, double)"/></exception>
        public Felt ToUnity(Place finger, double scale = 1)
        {
            Frames.CheckScale(scale);
            finger = finger.Checked("finger");
            var force = Frames.Turned(finger, 1, new double[] { ForceYN, ForceZN, -ForceXN });
            var torque = Frames.Turned(finger, 1, new double[] { TorqueYNMm, TorqueZNMm, -TorqueXNMm });
            var centre = Frames.Turned(finger, 1, new double[] { CentreYMm, CentreZMm, -CentreXMm });
            double metres = scale / Frames.MmPerUnit;
            return new Felt
            {
                ForceX = force[0], ForceY = force[1], ForceZ = force[2],
                // By the left hand's rule.
                TorqueX = -1e-3 * torque[0], TorqueY = -1e-3 * torque[1], TorqueZ = -1e-3 * torque[2],
                X = finger.X + metres * centre[0], Y = finger.Y + metres * centre[1], Z = finger.Z + metres * centre[2],
            };
        }
    }

    /// <summary>Points and meshes between Unity's axes and those of the finger, and of shapes.</summary>
    public static class Frames
    {
        internal const double MmPerUnit = 1000;

        /// <summary>A vertex of the finger (x y z, mm) in the drawn finger's own axes, metres: right, up, ahead.</summary>
        public static void ToUnity(float xMm, float yMm, float zMm, out float x, out float y, out float z)
        {
            x = (float)(yMm / MmPerUnit);
            y = (float)(zMm / MmPerUnit);
            z = (float)(-xMm / MmPerUnit);
        }

        /// <summary>A vertex of an object's mesh, in its own axes in Unity, for the <c>vertices_mm</c> of a hello. Turn its triangles too.</summary>
        public static void FromUnity(float x, float y, float z, out float xMm, out float yMm, out float zMm)
        {
            xMm = (float)(-z * MmPerUnit);
            yMm = (float)(x * MmPerUnit);
            zMm = (float)(y * MmPerUnit);
        }

        /// <summary>Triangles the other way round: Unity's are clockwise seen from outside, the atlas's and a hello's counter-clockwise.</summary>
        public static int[] Turned(int[] triangles)
        {
            var turned = (int[])triangles.Clone();
            for (int k = 0; k + 2 < turned.Length; k += 3)
            {
                int second = turned[k + 1];
                turned[k + 1] = turned[k + 2];
                turned[k + 2] = second;
            }
            return turned;
        }

        internal static PapillaException Refused(string why)
        {
            return new PapillaException(new Problem("bad_contact", why));
        }

        internal static void CheckScale(double scale)
        {
            if (!(scale > 0) || double.IsInfinity(scale)) throw Refused("scale says how many times as large as life all is drawn; it is " + scale);
        }

        internal static double Length(double[] v)
        {
            return Math.Sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        }

        /// <summary>A vector turned as the place is; sense -1: back.</summary>
        internal static double[] Turned(Place by, double sense, double[] v)
        {
            double a = sense * by.TurnX, b = sense * by.TurnY, c = sense * by.TurnZ;
            double x = 2 * (b * v[2] - c * v[1]), y = 2 * (c * v[0] - a * v[2]), z = 2 * (a * v[1] - b * v[0]);
            return new[] { v[0] + by.TurnW * x + b * z - c * y, v[1] + by.TurnW * y + c * x - a * z, v[2] + by.TurnW * z + a * y - b * x };
        }

        /// <summary>The turn whose z is ahead and whose y is up; both of length one, square to each other.</summary>
        internal static Place Looking(double[] z, double[] y)
        {
            double[] x = { y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0] };
            double trace = x[0] + y[1] + z[2];
            Place turn;
            if (trace > 0) turn = new Place(0, 0, 0, y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + trace);
            else if (x[0] >= y[1] && x[0] >= z[2]) turn = new Place(0, 0, 0, 1 + x[0] - y[1] - z[2], x[1] + y[0], x[2] + z[0], y[2] - z[1]);
            else if (y[1] >= z[2]) turn = new Place(0, 0, 0, x[1] + y[0], 1 - x[0] + y[1] - z[2], y[2] + z[1], z[0] - x[2]);
            else turn = new Place(0, 0, 0, x[2] + z[0], y[2] + z[1], 1 - x[0] - y[1] + z[2], x[1] - y[0]);
            return turn.Checked("joints");
        }
    }
}
