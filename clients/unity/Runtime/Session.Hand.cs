namespace Papilla
{
    /// <content>
    /// Fingers: each has the newest frame that has not left and its newest answer. What they touch: objects or gaps in, forces out
    /// (docs/reference/protocol.md).
    /// </content>
    public sealed partial class Session
    {
        /// <summary>Fingers of a session.</summary>
        public const int FingersMax = 10;

        sealed class Finger
        {
            internal Frame Waiting = new Frame();
            internal bool IsWaiting, IsFresh;
            internal int Number;
            // When the frame that waits was handed over, by the system's clock.
            internal ulong BornUs;
            internal Answer Newest = new Answer(), Taken = new Answer();
        }

        /// <summary>What became of the place of a frame that was handed over.</summary>
        struct Handed
        {
            internal uint Own, Superseded;
            internal bool DidSupersede;
            internal int Finger;
        }

        // A finger's first frame takes its memory.
        readonly Finger[] fingers = new Finger[FingersMax];
        Frame draft = new Frame();
        int turn;

        /// <summary>
        /// Sends where the objects of the hello are in a finger's frame; its newest poses replace those that have not left. The frame's
        /// sequence.
        /// </summary>
        public uint SendPoses(Pose[] poses, int finger = 0, NetForce? net = null)
        {
            if (poses.Length > Wire.ObjectsMax) throw new PapillaException(new Problem("bad_contact", "a session has at most 16 objects"));
            ulong timeUs = ClockUs();
            Handed handed;
            lock (gate)
            {
                draft.EncodePoses(poses, finger, net);
                handed = HandOver(finger, timeUs);
            }
            return Told(handed);
        }

        /// <summary>
        /// Sends that tracking of a finger is lost. Better than an old pose, or one of zeros: the answer is zero, no unit fires, and nothing
        /// bursts when tracking comes back. The frame's sequence.
        /// </summary>
        public uint SendNotTracked(int finger = 0)
        {
            ulong timeUs = ClockUs();
            Handed handed;
            lock (gate)
            {
                draft.EncodeNotTracked(finger);
                handed = HandOver(finger, timeUs);
            }
            return Told(handed);
        }

        /// <summary>
        /// Sends how deep the undeformed skin lies in things, mm, negative in air: at the vertices or as a map, as the hello says; with
        /// its <c>velocity</c>, x y z mm/s of each vertex behind them. The frame's sequence.
        /// </summary>
        public uint SendGaps(float[] depthMm, int finger = 0, NetForce? net = null)
        {
            if (depthMm.Length > Wire.MapLength) throw new PapillaException(new Problem("wrong_length", "gaps have at most 224 x 224 samples"));
            ulong timeUs = ClockUs();
            Handed handed;
            lock (gate)
            {
                draft.EncodeGaps(depthMm, finger, net);
                handed = HandOver(finger, timeUs);
            }
            return Told(handed);
        }

        /// <summary>
        /// The finger's newest rendered answer that was not taken yet; valid until the next call. For one thread, as a game's Update.
        /// </summary>
        public bool TryTakeLatest(out Answer answer, int finger = 0)
        {
            lock (telling)
            {
                var of = finger >= 0 && finger < FingersMax ? fingers[finger] : null;
                if (of != null && of.IsFresh)
                {
                    of.IsFresh = false;
                    var old = of.Taken;
                    of.Taken = of.Newest;
                    of.Newest = old;
                    answer = of.Taken;
                    return true;
                }
            }
            answer = null;
            return false;
        }

        /// <summary>Makes the draft the finger's frame that waits; with the gate held.</summary>
        Handed HandOver(int finger, ulong timeUs)
        {
            if (finger < 0 || finger >= FingersMax) throw new PapillaException(new Problem("bad_contact", "a session has at most 10 fingers"));
            if (fingers[finger] == null) fingers[finger] = new Finger { Number = finger };
            var of = fingers[finger];
            var handed = new Handed { Own = ++sequence, Superseded = of.Waiting.Sequence, DidSupersede = of.IsWaiting, Finger = finger };
            if (of.IsWaiting) SupersededByClient++;
            draft.Stamp(handed.Own, timeUs, DeadlineUs);
            var old = of.Waiting;
            of.Waiting = draft;
            draft = old;
            of.IsWaiting = true;
            of.BornUs = Now();
            System.Threading.Monitor.PulseAll(gate);
            return handed;
        }

        uint Told(Handed handed)
        {
            if (handed.DidSupersede) Tell(handed.Superseded, handed.Finger, Status.Superseded, null);
            return handed.Own;
        }

        /// <summary>A finger whose frame waits, fingers taking turns; null: none does. With the gate held.</summary>
        Finger NextWaiting()
        {
            for (int k = 0; k < FingersMax; k++)
            {
                turn = (turn + 1) % FingersMax;
                if (fingers[turn] != null && fingers[turn].IsWaiting) return fingers[turn];
            }
            return null;
        }

        /// <summary>Ends every frame that waits with this status.</summary>
        void TellWaiting(Status status)
        {
            EndWaiting(status, ulong.MaxValue);
        }

        /// <summary>Ends the frames that wait and were handed over by then; false: there was none.</summary>
        bool EndWaiting(Status status, ulong bornUs)
        {
            bool any = false;
            for (int k = 0; k < FingersMax; k++)
            {
                uint own;
                lock (gate)
                {
                    var of = fingers[k];
                    if (of == null || !of.IsWaiting || of.BornUs > bornUs) continue;
                    of.IsWaiting = false;
                    if (status == Status.Superseded) SupersededByClient++;
                    own = of.Waiting.Sequence;
                }
                any = true;
                Tell(own, k, status, null);
            }
            return any;
        }
    }
}
