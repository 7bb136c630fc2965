// The few types of Unity that the package and its sample name, so that a compiler without Unity checks their use. Nothing here does anything.
namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 operator -(Vector3 of) { return new Vector3(-of.x, -of.y, -of.z); }
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
    }

    public struct Pose
    {
        public Vector3 position;
        public Quaternion rotation;
        public Pose(Vector3 position, Quaternion rotation) { this.position = position; this.rotation = rotation; }
    }

    public struct Color32
    {
        public Color32(byte r, byte g, byte b, byte a) { }
        public static Color32 Lerp(Color32 a, Color32 b, float t) { return a; }
    }

    public class Object { }

    public class Component : Object
    {
        public Transform transform { get { return null; } }
        public T GetComponent<T>() where T : class { return null; }
    }

    public class MonoBehaviour : Component { }

    public class Transform : Component
    {
        public Vector3 position { get; set; }
        public Quaternion rotation { get; set; }
    }

    public class Rigidbody : Component
    {
        public void AddForceAtPosition(Vector3 force, Vector3 position) { }
    }

    public class Mesh : Object
    {
        public Vector3[] vertices { get; set; }
        public int[] triangles { get; set; }
        public Color32[] colors32 { get; set; }
        public void RecalculateNormals() { }
    }

    public class MeshFilter : Component
    {
        public Mesh sharedMesh { get; set; }
    }

    public class MeshRenderer : Component { }

    public static class Debug
    {
        public static void LogWarning(object of) { }
        public static void LogError(object of) { }
    }

    public static class Time
    {
        public static float time { get { return 0; } }
    }

    public static class Mathf
    {
        public static float Cos(float of) { return of; }
        public static float Sin(float of) { return of; }
    }

    public sealed class SerializeField : System.Attribute { }

    public sealed class RequireComponent : System.Attribute
    {
        public RequireComponent(System.Type first, System.Type second) { }
    }
}
