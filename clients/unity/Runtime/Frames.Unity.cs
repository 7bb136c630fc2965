#if UNITY_5_3_OR_NEWER
using UnityEngine;

namespace Papilla
{
    /// <summary>The same of Unity's own types. A finger's forward (z) points to the tip, its up (y) out of the nail.</summary>
    public static class UnityFrames
    {
        public static Place ToPlace(this Transform of)
        {
            return ToPlace(new UnityEngine.Pose(of.position, of.rotation));
        }

        /// <summary>Also of a joint of XR Hands, in the world: its pose comes relative to the XR origin.</summary>
        public static Place ToPlace(this UnityEngine.Pose of)
        {
            return new Place(of.position.x, of.position.y, of.position.z, of.rotation.x, of.rotation.y, of.rotation.z, of.rotation.w);
        }

        public static UnityEngine.Pose ToUnity(this Place of)
        {
            return new UnityEngine.Pose(
                new Vector3((float)of.X, (float)of.Y, (float)of.Z),
                new Quaternion((float)of.TurnX, (float)of.TurnY, (float)of.TurnZ, (float)of.TurnW));
        }

        /// <summary>Where the object is in the finger's frame; <paramref name="scale"/> says how many times as large as life all is drawn.</summary>
        public static Pose PoseInFinger(this Transform body, Transform finger, float scale = 1)
        {
            return Pose.FromUnity(finger.ToPlace(), body.ToPlace(), scale);
        }

        /// <summary>N on the finger, for <c>AddForceAtPosition</c>; an object feels the opposite.</summary>
        public static Vector3 ForceToUnity(this Touch touch, Transform finger)
        {
            var felt = touch.ToUnity(finger.ToPlace());
            return new Vector3((float)felt.ForceX, (float)felt.ForceY, (float)felt.ForceZ);
        }

        /// <summary>N m about the finger's origin, for <c>AddTorque</c>.</summary>
        public static Vector3 TorqueToUnity(this Touch touch, Transform finger)
        {
            var felt = touch.ToUnity(finger.ToPlace());
            return new Vector3((float)felt.TorqueX, (float)felt.TorqueY, (float)felt.TorqueZ);
        }

        /// <summary>Centre of the pressure, in the world.</summary>
        public static Vector3 CentreToUnity(this Touch touch, Transform finger, float scale = 1)
        {
            var felt = touch.ToUnity(finger.ToPlace(), scale);
            return new Vector3((float)felt.X, (float)felt.Y, (float)felt.Z);
        }

        /// <summary>The atlas's skin as a mesh in the finger's own axes, metres.</summary>
        public static Mesh ToMesh(this Atlas atlas)
        {
            var vertices = new Vector3[atlas.VertexCount];
            for (int i = 0; i < vertices.Length; i++)
            {
                Frames.ToUnity(atlas.SkinMm[3 * i], atlas.SkinMm[3 * i + 1], atlas.SkinMm[3 * i + 2], out vertices[i].x, out vertices[i].y, out vertices[i].z);
            }
            var mesh = new Mesh { vertices = vertices, triangles = Frames.Turned(atlas.Triangles) };
            mesh.RecalculateNormals();
            return mesh;
        }
    }
}
#endif
