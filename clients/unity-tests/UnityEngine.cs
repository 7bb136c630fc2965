// The few types of Unity that the package and its sample name, so that a compiler without Unity checks their use. Nothing here does anything.
namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public float magnitude { get { return 0; } }
        public static Vector3 one { get { return new Vector3(1, 1, 1); } }
        public static Vector3 operator -(Vector3 of) { return new Vector3(-of.x, -of.y, -of.z); }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return a; }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return a; }
        public static Vector3 operator *(Vector3 a, float by) { return a; }
    }

    public struct Vector2
    {
        public float x, y;
        public static Vector2 zero { get { return new Vector2(); } }
        public static implicit operator Vector2(Vector3 of) { return new Vector2(); }
    }

    public struct Quaternion
    {
        public float x, y, z, w;
        public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public static Quaternion LookRotation(Vector3 forward) { return new Quaternion(); }
        public static Quaternion operator *(Quaternion a, Quaternion b) { return a; }
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
        public GameObject gameObject { get { return null; } }
        public T GetComponent<T>() where T : class { return null; }
    }

    public class MonoBehaviour : Component { }

    public sealed class GameObject : Object
    {
        public void SetActive(bool isActive) { }
    }

    public sealed class Camera : Component { }

    public static class Screen
    {
        public static int width { get { return 1; } }
        public static int height { get { return 1; } }
    }

    public static class Input
    {
        public static Vector3 mousePosition { get { return new Vector3(); } }
        public static bool GetMouseButton(int button) { return false; }
    }

    public static class SubsystemManager
    {
        public static void GetSubsystems<T>(System.Collections.Generic.List<T> into) { }
    }

    public sealed class TooltipAttribute : System.Attribute
    {
        public TooltipAttribute(string words) { }
    }

    public class Transform : Component
    {
        public Vector3 position { get; set; }
        public Quaternion rotation { get; set; }
        public Vector3 localPosition { get; set; }
        public Quaternion localRotation { get; set; }
        public Vector3 localScale { get; set; }
        public void SetPositionAndRotation(Vector3 position, Quaternion rotation) { }
        public Vector3 TransformPoint(Vector3 of) { return of; }
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
        public const float PI = 3.14159274f;
        public static float Cos(float of) { return of; }
        public static float Sin(float of) { return of; }
    }

    public sealed class SerializeField : System.Attribute { }

    public sealed class RequireComponent : System.Attribute
    {
        public RequireComponent(System.Type first, System.Type second) { }
    }
}

namespace UnityEngine.XR
{
    public enum XRNode { CenterEye, RightHand }

    public struct InputFeatureUsage<T> { }

    public static class CommonUsages
    {
        public static readonly InputFeatureUsage<Vector3> centerEyePosition;
        public static readonly InputFeatureUsage<Quaternion> centerEyeRotation;
    }

    public struct HapticCapabilities
    {
        public bool supportsImpulse { get { return false; } }
    }

    public struct InputDevice
    {
        public bool TryGetHapticCapabilities(out HapticCapabilities capabilities) { capabilities = new HapticCapabilities(); return false; }
        public bool SendHapticImpulse(uint channel, float amplitude, float duration) { return false; }
        public void StopHaptics() { }
        public bool TryGetFeatureValue(InputFeatureUsage<Vector3> usage, out Vector3 value) { value = new Vector3(); return false; }
        public bool TryGetFeatureValue(InputFeatureUsage<Quaternion> usage, out Quaternion value) { value = new Quaternion(); return false; }
    }

    public static class InputDevices
    {
        public static InputDevice GetDeviceAtXRNode(XRNode node) { return new InputDevice(); }
    }
}

namespace UnityEngine.XR.Hands
{
    public enum XRHandJointID { IndexDistal, IndexTip }

    public struct XRHandJoint
    {
        public bool TryGetPose(out Pose pose) { pose = new Pose(); return false; }
    }

    public struct XRHand
    {
        public bool isTracked { get { return false; } }
        public XRHandJoint GetJoint(XRHandJointID id) { return new XRHandJoint(); }
    }

    public sealed class XRHandSubsystem
    {
        public XRHand rightHand { get { return new XRHand(); } }
    }
}

namespace UnityEngine.InputSystem
{
    public sealed class Vector2Control
    {
        public Vector2 ReadValue() { return new Vector2(); }
    }

    public sealed class ButtonControl
    {
        public bool isPressed { get { return false; } }
    }

    public sealed class Mouse
    {
        public static Mouse current { get { return null; } }
        public Vector2Control position { get { return null; } }
        public ButtonControl leftButton { get { return null; } }
    }
}
