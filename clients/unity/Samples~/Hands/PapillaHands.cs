using System.Collections.Generic;
using System.Threading;
using Papilla;
using UnityEngine;
using UnityEngine.XR;

/// <summary>
/// The scene Hands. The right index finger of a tracked hand (package XR Hands) touches three objects. Without a tracked hand the finger
/// visits them by itself, and follows the mouse while its left button is held. Its skin shows SED, an arrow the force, which a controller in the right hand feels as well. Needs a running service.
/// </summary>
public sealed class PapillaHands : MonoBehaviour
{
    [SerializeField] string address = "http://127.0.0.1:7224";
    [SerializeField] Transform[] objects = new Transform[0];
    [SerializeField] Transform finger = null;
    [SerializeField] MeshFilter arrow = null;
    [SerializeField] Transform rig = null;
    [SerializeField] Camera head = null;
    [Tooltip("SED that is drawn in the darkest colour, J/m3")]
    [SerializeField] float sedOfDarkest = 100;
    [Tooltip("Length of the arrow for 1 N, m")]
    [SerializeField] float arrowMPerN = 0.06f;

    static readonly Color32 Pale = new Color32(219, 168, 143, 255), Dark = new Color32(120, 0, 60, 255);
    // The skin is drawn so much above what it touches, or both surfaces would show through each other.
    const float LiftMm = 0.1f;
    // Where the finger was in the last frames, by their sequences: it is drawn where it was when it felt what comes back.
    readonly Place[] sent = new Place[256];
    readonly List<Vector3> arrowAt = new List<Vector3>();
    readonly Device motor = new Device(Device.Force(1));
    Papilla.Pose[] poses;
    Session session;
    Mesh skin;
    Color32[] colours;
    Vector3[] vertices;
    Papilla.Atlas atlas;
    volatile Papilla.Atlas loaded;
    volatile bool isLost;
    bool isInHeadset, wasTracked;
    Place last;

    void Start()
    {
        poses = new Papilla.Pose[objects.Length];
        session = new Session(address, HandsScene.Hello()).Open();
        // No answer came in time, or the service refuses: nothing is felt, and actuators go to zero, until the next answer.
        session.Answered += outcome => isLost = outcome.Status == Status.Ok ? false : isLost || outcome.Status == Status.Lost || outcome.Status == Status.Error;
        // HTTP waits: not on the main thread.
        new Thread(() => loaded = PapillaHttp.LoadAtlas(address)) { IsBackground = true }.Start();
        arrow.sharedMesh = ArrowMesh();
        arrow.gameObject.SetActive(false);
    }

    void Update()
    {
        if (skin == null && loaded != null) Draw(loaded);
        FollowHead();
        DeviceCommand command;
        if (motor.TryPoll(out command)) Controller.Vibrate(command);
        Place found;
        bool isTracked = HandJoints.TryFinger(rig, out found);
        // A hand that was there and is lost is told as that: nothing is felt until it is back.
        if (wasTracked && !isTracked)
        {
            session.SendNotTracked();
            Controller.Vibrate(motor.Stop());
            Show(null, last);
            return;
        }
        wasTracked = isTracked;
        if (!isTracked) found = WithoutHand();
        last = found;
        for (int k = 0; k < poses.Length; k++) poses[k] = Papilla.Pose.FromUnity(found, objects[k].ToPlace());
        sent[session.SendPoses(poses) % sent.Length] = found;
        Answer answer;
        if (session.TryTakeLatest(out answer))
        {
            motor.Feed(answer);
            Show(answer, sent[answer.Sequence % sent.Length]);
        }
        else if (isLost || session.Ready == null) Show(null, found);
    }

    void Draw(Papilla.Atlas of)
    {
        atlas = of;
        vertices = new Vector3[atlas.VertexCount];
        skin = atlas.ToMesh();
        colours = new Color32[atlas.VertexCount];
        finger.GetComponent<MeshFilter>().sharedMesh = skin;
    }

    /// <param name="answer">null: nothing is felt</param>
    void Show(Answer answer, Place place)
    {
        var at = place.ToUnity();
        finger.SetPositionAndRotation(at.position, at.rotation);
        bool isFelt = answer != null && !answer.NoContact;
        arrow.gameObject.SetActive(isFelt);
        if (isFelt)
        {
            var force = answer.Touch.ForceToUnity(finger);
            arrow.transform.position = answer.Touch.CentreToUnity(finger);
            arrow.transform.rotation = Quaternion.LookRotation(force);
            arrow.transform.localScale = Vector3.one * (arrowMPerN * force.magnitude);
        }
        if (skin == null) return;
        var sed = isFelt ? answer.Sed : null;
        for (int k = 0; k < colours.Length; k++)
        {
            float x = atlas.SkinMm[3 * k], y = atlas.SkinMm[3 * k + 1], z = atlas.SkinMm[3 * k + 2];
            if (isFelt)
            {
                x += answer.DisplacementMm[3 * k];
                y += answer.DisplacementMm[3 * k + 1];
                z += answer.DisplacementMm[3 * k + 2] + LiftMm;
            }
            Frames.ToUnity(x, y, z, out vertices[k].x, out vertices[k].y, out vertices[k].z);
            colours[k] = Color32.Lerp(Pale, Dark, sed == null ? 0 : sed[k] / sedOfDarkest);
        }
        skin.vertices = vertices;
        skin.colors32 = colours;
    }

    /// <summary>The mouse while its left button is held, else by itself; the script's own object is the middle of the objects' tops.</summary>
    Place WithoutHand()
    {
        float x, y;
        var at = Pointer.TryHeld(out x, out y) ? HandsScene.Finger(3 * HandsScene.PitchM * (x - 0.5), 0.001 - 0.008 * y) : HandsScene.FingerAt(Time.time);
        var origin = transform.position;
        return new Place(origin.x + at.X, origin.y + at.Y, origin.z + at.Z);
    }

    /// <summary>A headset's pose moves the camera; the first one lays the objects before and below the eyes.</summary>
    void FollowHead()
    {
        Vector3 position;
        Quaternion rotation;
        var eyes = InputDevices.GetDeviceAtXRNode(XRNode.CenterEye);
        if (!eyes.TryGetFeatureValue(CommonUsages.centerEyePosition, out position) || !eyes.TryGetFeatureValue(CommonUsages.centerEyeRotation, out rotation)) return;
        if (!isInHeadset) rig.position = transform.position + new Vector3(0, 0.25f, -0.4f) - position;
        isInHeadset = true;
        head.transform.localPosition = position;
        head.transform.localRotation = rotation;
    }

    /// <summary>An arrow of length 1 along z, four-sided.</summary>
    Mesh ArrowMesh()
    {
        const float thin = 0.03f, wide = 0.09f, neck = 0.75f;
        float[] radii = { 0, thin, thin, wide, 0 }, along = { 0, 0, neck, neck, 1 };
        var triangles = new List<int>();
        for (int ring = 0; ring < radii.Length; ring++)
        {
            for (int k = 0; k < 4; k++) arrowAt.Add(new Vector3(radii[ring] * Mathf.Cos(k * Mathf.PI / 2), radii[ring] * Mathf.Sin(k * Mathf.PI / 2), along[ring]));
        }
        for (int ring = 0; ring + 1 < radii.Length; ring++)
        {
            for (int k = 0; k < 4; k++)
            {
                int a = 4 * ring + k, b = 4 * ring + (k + 1) % 4;
                triangles.AddRange(new[] { a, b, a + 4, b, b + 4, a + 4 });
            }
        }
        var mesh = new Mesh { vertices = arrowAt.ToArray(), triangles = triangles.ToArray() };
        mesh.RecalculateNormals();
        return mesh;
    }

    static InputDevice Controller
    {
        get { return InputDevices.GetDeviceAtXRNode(XRNode.RightHand); }
    }

    void OnDestroy()
    {
        Controller.Vibrate(motor.Stop());
        if (session != null) session.Dispose();
    }
}
