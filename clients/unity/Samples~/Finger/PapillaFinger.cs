using System.Threading;
using Papilla;
using UnityEngine;

/// <summary>
/// The atlas's skin as a mesh whose vertex colours are the SED of the last answer: forward (z) is the tip, up (y) the nail. Give it a material that shows
/// vertex colours. A contact of half a newton circles the pad; a game fills <c>pressurePa</c> from its own contacts. <c>PapillaTouch</c> sends where objects are.
/// </summary>
[RequireComponent(typeof(MeshFilter), typeof(MeshRenderer))]
public sealed class PapillaFinger : MonoBehaviour
{
    [SerializeField] string address = "http://127.0.0.1:7224";
    [SerializeField] string tier = "nano";
    [SerializeField] float sedOfWhite = 300;

    readonly float[] pressurePa = new float[Wire.MapLength];
    Papilla.Atlas atlas;
    Session session;
    Mesh mesh;
    float[] sed;
    Color32[] colours;
    Thread loading;
    volatile Papilla.Atlas loaded;
    volatile bool isLost;

    void Start()
    {
        session = new Session(address, new Hello { Tier = tier }).Open();
        // No answer came in time, or the server refuses: nothing is felt, and actuators go to zero, until the next answer.
        session.Answered += outcome => isLost = outcome.Status == Status.Ok ? false : isLost || outcome.Status == Status.Lost || outcome.Status == Status.Error;
        // HTTP waits: not on the main thread.
        loading = new Thread(() => loaded = PapillaHttp.LoadAtlas(address)) { IsBackground = true };
        loading.Start();
    }

    void Update()
    {
        if (atlas == null && loaded != null) Build(loaded);
        if (atlas == null) return;
        System.Array.Clear(pressurePa, 0, pressurePa.Length);
        atlas.AddContact(10 + 2 * Mathf.Cos(Time.time), 2 * Mathf.Sin(Time.time), -6.5, 0.5, 2.5, pressurePa);
        session.Send(pressurePa);
        Answer answer;
        if (session.TryTakeLatest(out answer)) atlas.AtVertices(answer.Map, sed);
        else if (isLost) System.Array.Clear(sed, 0, sed.Length);
        else return;
        for (int i = 0; i < sed.Length; i++) colours[i] = Color32.Lerp(new Color32(219, 168, 143, 255), new Color32(120, 0, 60, 255), sed[i] / sedOfWhite);
        mesh.colors32 = colours;
    }

    void Build(Papilla.Atlas from)
    {
        atlas = from;
        sed = new float[atlas.VertexCount];
        colours = new Color32[atlas.VertexCount];
        mesh = atlas.ToMesh();
        GetComponent<MeshFilter>().sharedMesh = mesh;
    }

    void OnDestroy()
    {
        if (session != null) session.Dispose();
    }
}
