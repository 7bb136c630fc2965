using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Threading;

namespace Papilla
{
    /// <summary>
    /// A session that keeps itself connected: pressure maps (Pa) or poses of objects out, maps of strain energy density (J/m3) and forces in. Two threads of its own
    /// move the bytes; <see cref="Send(float[])"/> never blocks, and the newest frame wins: one that has not left this client is superseded by a
    /// newer one. Frames and answers allocate nothing.
    /// </summary>
    public sealed partial class Session : IDisposable
    {
        const int AttemptMs = 5000, RetryLeastMs = 100, RetryMostMs = 250, OutstandingMax = 1024, WatchMs = 20;

        /// <summary>Once for every frame, whatever became of it; on a thread of the client's. The answer is valid during the call.</summary>
        public event Action<Answer> Answered;
        /// <summary>A session is ready, the first or a later one; on a thread of the client's.</summary>
        public event Action<Ready> SessionReady;
        /// <summary>A hello was refused, or the session has a fault; on a thread of the client's.</summary>
        public event Action<Problem> Refused;

        /// <summary>The terms of the session; null while there is none.</summary>
        public Ready Ready { get { return ready; } }
        /// <summary>Deadline of the frames to come, us; 0: the session's budget.</summary>
        public uint DeadlineUs;
        /// <summary>Frames that went out, and those that a newer one superseded before they left.</summary>
        public int Sent, SupersededByClient;
        /// <summary>Connections that the session had: more than 1 after one was lost, or the service asked it to move.</summary>
        public int Connections;
        /// <summary>
        /// A frame without an answer for so long is <see cref="Status.Lost"/>, ms, whether it waits for a connection or for the server; in the
        /// second case the connection is given up and another made. Set the actuators to zero then.
        /// </summary>
        public int TimeoutMs = 5000;
        /// <summary>
        /// Called with what people should know, each thing once, on a thread of the client's: the first refused hello, the first refused
        /// frame, the first one out of range, the first timeout, what the server asks of the hello, a budget that it cannot meet. By default
        /// Unity's console, or standard error.
        /// </summary>
        public Action<string> Warn = Print;
        /// <summary>What people were told so far, each thing once.</summary>
        public string[] Warnings { get { lock (warnings) return warnings.ToArray(); } }
        /// <summary>us of the client's clock.</summary>
        public Func<ulong> ClockUs = Now;

        readonly ServerAddress server;
        readonly Uri uri;
        readonly Func<ITransport> newTransport;
        readonly object gate = new object(), telling = new object();
        // What has left and has no outcome, by sequence.
        readonly Dictionary<uint, Left> outstanding = new Dictionary<uint, Left>(OutstandingMax);
        readonly HashSet<string> told = new HashSet<string>();
        readonly List<string> warnings = new List<string>();
        readonly byte[] message = new byte[Wire.MessageBytesMax];
        readonly Answer brief = new Answer();
        readonly Random random = new Random();
        Answer filling = new Answer();
        Frame leaving = new Frame();
        bool isClosed, isRefused, isFirstReady;
        uint sequence, renewedFrom;
        Hello hello, helloBefore;
        Ready readyBefore, olderReady;
        Problem refusal;
        // Why the last attempt to connect failed.
        string fault;
        volatile Ready ready;
        ITransport transport;
        Thread receiver, sender;
        Timer watch;

        /// <param name="address">where the server is; see <see cref="ServerAddress"/></param>
        /// <param name="hello">what to ask for; null: the defaults</param>
        /// <param name="token">bearer token, for a server that asks for one; blanks around it go</param>
        /// <param name="newTransport">another WebSocket than <see cref="SocketTransport"/></param>
        public Session(string address, Hello hello = null, string token = null, Func<ITransport> newTransport = null)
        {
            server = new ServerAddress(address);
            string clean = ServerAddress.CleanToken(token);
            uri = new Uri(server.Session() + (clean == null ? "" : "?access_token=" + Uri.EscapeDataString(clean)));
            this.hello = hello ?? new Hello();
            this.newTransport = newTransport ?? (() => new SocketTransport());
        }

        /// <summary>Connects, and again whenever the connection is lost, until <see cref="Dispose"/>.</summary>
        public Session Open()
        {
            receiver = new Thread(Receive) { IsBackground = true, Name = "papilla receive" };
            sender = new Thread(SendWaiting) { IsBackground = true, Name = "papilla send" };
            receiver.Start();
            sender.Start();
            watch = new Timer(none => Expire(), null, WatchMs, WatchMs);
            return this;
        }

        /// <summary>Waits for a session; throws a PapillaException if the hello is refused, a TimeoutException if none comes.</summary>
        public Ready WaitReady(int timeoutMs = AttemptMs)
        {
            var watch = Stopwatch.StartNew();
            lock (gate)
            {
                while (ready == null)
                {
                    if (isRefused) throw new PapillaException(refusal);
                    int left = timeoutMs - (int)watch.ElapsedMilliseconds;
                    if (left <= 0 || isClosed)
                    {
                        string why = fault == null ? "" : ": " + fault;
                        throw new TimeoutException("no session at " + server.Session() + " within " + timeoutMs + " ms" + why + "; is papilla-server running there?");
                    }
                    Monitor.Wait(gate, left);
                }
                return ready;
            }
        }

        /// <summary>New terms in the open session: answered by SessionReady, or by Refused and the old ones stay.</summary>
        public void Renew(Hello next)
        {
            ITransport open;
            TellWaiting(Status.Superseded);
            lock (gate)
            {
                if (ready != null)
                {
                    helloBefore = hello;
                    readyBefore = ready;
                }
                PutOffMove();
                hello = next;
                renewedFrom = sequence + 1;
                ready = null;
                isRefused = false;
                open = transport;
                Monitor.PulseAll(gate);
            }
            if (open != null) Greet(open);
        }

        /// <summary>Sends a whole map (224 x 224, Pa, row-major); it may be overwritten afterwards. The frame's sequence.</summary>
        public uint Send(float[] pressurePa)
        {
            if (pressurePa.Length != Wire.MapLength) throw new PapillaException(new Problem("wrong_length", "a map has 50176 samples"));
            return Put(pressurePa, 0, 0, Wire.SidePx, Wire.SidePx);
        }

        /// <summary>Sends a rectangle of the map, width x height samples; all other pixels are 0. The frame's sequence.</summary>
        public uint Send(float[] samplesPa, int column, int row, int width, int height)
        {
            bool fits = column >= 0 && row >= 0 && width >= 0 && height >= 0 && column + width <= Wire.SidePx && row + height <= Wire.SidePx;
            if (!fits || width * height > samplesPa.Length) throw new PapillaException(new Problem("wrong_shape", "the window does not fit the map or its samples"));
            return Put(samplesPa, column, row, width, height);
        }

        static void Print(string words)
        {
#if UNITY_5_3_OR_NEWER
            UnityEngine.Debug.LogWarning("Papilla: " + words);
#else
            Console.Error.WriteLine("papilla: " + words);
#endif
        }

        /// <summary>Whether nothing of that code was told yet; from now on something was.</summary>
        bool IsNew(string code)
        {
            lock (warnings) return told.Count < 100 && told.Add(code);
        }

        void TellPeople(string words)
        {
            lock (warnings) warnings.Add(words);
            var warn = Warn;
            if (warn != null) warn(words);
        }

        /// <summary>What the server asks, and a budget that it cannot meet.</summary>
        void Question(Ready terms)
        {
            foreach (var each in terms.Json["warnings"] ?? new Newtonsoft.Json.Linq.JArray())
            {
                string words = (string)each["member"] + ": " + (string)each["question"];
                if (IsNew(words)) TellPeople(words);
            }
            if ((bool?)terms.Json["meets_budget"] != false) return;
            long budget = (long)terms.Json["budget_us"];
            string late = "a frame of tier " + terms.Tier + " takes some " + terms.PredictedLatencyUs + " us, and budget_us is " + budget + ", so that frames may be late";
            if (budget < 100) late += "; it counts microseconds: were " + budget + " ms meant?";
            if (IsNew(late)) TellPeople(late);
        }

        /// <summary>us since the system started.</summary>
        public static ulong Now()
        {
            return (ulong)(Stopwatch.GetTimestamp() * (1e6 / Stopwatch.Frequency));
        }

        uint Put(float[] values, int column, int row, int width, int height)
        {
            ulong timeUs = ClockUs();
            Handed handed;
            lock (gate)
            {
                draft.Encode(values, 0, width, column, row, width, height, hello.SampleType, (float)(hello.PressureScalePa ?? 0));
                handed = HandOver(0, timeUs);
            }
            return Told(handed);
        }

        /// <summary>Ends the session. Frames without an answer are lost.</summary>
        public void Dispose()
        {
            lock (gate)
            {
                if (isClosed) return;
                isClosed = true;
                if (watch != null) watch.Dispose();
                if (transport != null) transport.Dispose();
                if (move != null && move.Next != null) move.Next.Dispose();
                Monitor.PulseAll(gate);
            }
            if (receiver == null) return;
            if (Thread.CurrentThread != receiver) receiver.Join(2 * AttemptMs);
            if (Thread.CurrentThread != sender) sender.Join(AttemptMs);
            if (mover != null && Thread.CurrentThread != mover) mover.Join(2 * AttemptMs);
            LoseAll();
            TellWaiting(Status.Lost);
        }
    }
}
