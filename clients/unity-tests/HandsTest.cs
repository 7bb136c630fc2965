using System;
using System.Linq;
using System.Threading;
using Papilla;

/// <summary>The sample Hands without Unity: its hello is taken, and its finger feels each of the objects where it presses, and none between them.</summary>
static class HandsTest
{
    static int Main()
    {
        using (var session = new Session(Environment.GetEnvironmentVariable("PAPILLA_URL"), HandsScene.Hello()).Open())
        {
            session.TimeoutMs = 30000;
            session.WaitReady(30000);
            // Down on each in the middle of its two seconds; up at their ends.
            for (int k = 0; k < 3; k++)
            {
                float felt = Felt(session, HandsScene.FingerAt(2 * k + 1)), above = Felt(session, HandsScene.FingerAt(2 * k));
                Console.WriteLine("object " + k + ": pushes back with " + felt + " N upwards, and with " + above + " N above it");
                if (!(felt > 0.05f) || above != 0) return 1;
            }
        }
        Console.WriteLine("ok unity: the sample's scene, by poses");
        return 0;
    }

    static float Felt(Session session, Place finger)
    {
        var poses = HandsScene.HalfM.Select((half, k) => Pose.FromUnity(finger, new Place(HandsScene.PitchM * (k - 1), -half, 0))).ToArray();
        uint sequence = session.SendPoses(poses);
        Answer answer = null;
        for (int tries = 0; tries < 30000; tries++)
        {
            if (session.TryTakeLatest(out answer) && answer.Sequence == sequence) break;
            Thread.Sleep(1);
        }
        if (answer == null || answer.Sequence != sequence) throw new Exception("no answer");
        // SED stands at the vertices, and is there where the finger is pressed.
        if ((answer.Sed.Max() > 1) != !answer.NoContact) throw new Exception("SED up to " + answer.Sed.Max());
        return (float)answer.Touch.ToUnity(finger).ForceY;
    }
}
