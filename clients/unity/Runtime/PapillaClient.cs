using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.IO;
using System.Net.Sockets;
using System.Text;
using System.Threading;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>
    /// A session that keeps itself connected: pressure maps (Pa) out, maps of strain energy density (J/m3) in. Two threads of its own
    /// move the bytes; <see cref="Send(float[])"/> never blocks, and the newest frame wins: one that has not left this client is replaced by a
    /// newer one. Frames and answers allocate nothing.
    /// </summary>
    public sealed class PapillaClient : IDisposable
    {
        const int AttemptMs = 5000, RetryLeastMs = 100, RetryMostMs = 250, OutstandingMax = 1024;

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
        /// <summary>Frames that went out, and those that a newer one replaced before.</summary>
        public int Sent, Replaced;
        /// <summary>us of the client's clock.</summary>
        public Func<ulong> ClockUs = Now;

        readonly Uri uri;
        readonly Func<ITransport> newTransport;
        readonly object gate = new object(), telling = new object();
        readonly HashSet<uint> outstanding = new HashSet<uint>();
        readonly byte[] message = new byte[Wire.MessageBytesMax];
        readonly Answer brief = new Answer();
        readonly Random random = new Random();
        Answer filling = new Answer(), newest = new Answer(), taken = new Answer();
        Frame waiting = new Frame(), leaving = new Frame();
        bool isWaiting, isFresh, isClosed, isRefused;
        uint sequence, termsFrom;
        Hello hello, helloBefore;
        Ready readyBefore, olderTerms;
        Problem refusal;
        volatile Ready ready;
        ITransport transport;
        Thread receiver, sender;

        /// <param name="address">http(s)://host[:port] of the server</param>
        /// <param name="hello">what to ask for; null: the defaults</param>
        /// <param name="token">bearer token, for a server that asks for one</param>
        /// <param name="newTransport">another WebSocket than <see cref="SocketTransport"/></param>
        public PapillaClient(string address, Hello hello = null, string token = null, Func<ITransport> newTransport = null)
        {
            var builder = new UriBuilder(new Uri(new Uri(address), "v1/session"));
            builder.Scheme = builder.Scheme == "https" || builder.Scheme == "wss" ? "wss" : "ws";
            if (token != null) builder.Query = "access_token=" + Uri.EscapeDataString(token);
            uri = builder.Uri;
            this.hello = hello ?? new Hello();
            this.newTransport = newTransport ?? (() => new SocketTransport());
            for (uint k = 0; k < OutstandingMax; k++) outstanding.Add(k);
            outstanding.Clear();
        }

        /// <summary>Connects, and again whenever the connection is lost, until <see cref="Dispose"/>.</summary>
        public PapillaClient Open()
        {
            receiver = new Thread(Receive) { IsBackground = true, Name = "papilla receive" };
            sender = new Thread(SendWaiting) { IsBackground = true, Name = "papilla send" };
            receiver.Start();
            sender.Start();
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
                    if (left <= 0 || isClosed) throw new TimeoutException("no session at " + uri + " within " + timeoutMs + " ms");
                    Monitor.Wait(gate, left);
                }
                return ready;
            }
        }

        /// <summary>New terms in the open session: answered by SessionReady, or by Refused and the old ones stay.</summary>
        public void Renew(Hello next)
        {
            ITransport open;
            uint replaced;
            bool didReplace;
            lock (gate)
            {
                didReplace = TakeWaiting(out replaced);
                if (ready != null)
                {
                    helloBefore = hello;
                    readyBefore = ready;
                }
                hello = next;
                termsFrom = sequence + 1;
                ready = null;
                isRefused = false;
                open = transport;
                Monitor.PulseAll(gate);
            }
            if (didReplace) Tell(replaced, Status.Superseded, null);
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

        /// <summary>The newest rendered answer that was not taken yet; valid until the next call. For one thread, as a game's Update.</summary>
        public bool TryTake(out Answer answer)
        {
            lock (telling)
            {
                if (isFresh)
                {
                    isFresh = false;
                    var old = taken;
                    taken = newest;
                    newest = old;
                    answer = taken;
                    return true;
                }
            }
            answer = null;
            return false;
        }

        /// <summary>us since the system started.</summary>
        public static ulong Now()
        {
            return (ulong)(Stopwatch.GetTimestamp() * (1e6 / Stopwatch.Frequency));
        }

        uint Put(float[] values, int column, int row, int width, int height)
        {
            ulong timeUs = ClockUs();
            uint replaced, own;
            bool didReplace;
            lock (gate)
            {
                didReplace = TakeWaiting(out replaced);
                own = ++sequence;
                waiting.Encode(values, 0, width, column, row, width, height, hello.SampleType, hello.PressureScalePa);
                waiting.Stamp(own, timeUs, DeadlineUs);
                isWaiting = true;
                Monitor.PulseAll(gate);
            }
            if (didReplace) Tell(replaced, Status.Superseded, null);
            return own;
        }

        /// <summary>Empties the place of the frame that waits; true if one did.</summary>
        bool TakeWaiting(out uint replaced)
        {
            replaced = waiting.Sequence;
            if (!isWaiting) return false;
            isWaiting = false;
            Replaced++;
            return true;
        }

        void SendWaiting()
        {
            while (true)
            {
                ITransport open;
                lock (gate)
                {
                    while (!isClosed && !(isWaiting && ready != null && transport != null && outstanding.Count < OutstandingMax)) Monitor.Wait(gate);
                    if (isClosed) return;
                    var frame = waiting;
                    waiting = leaving;
                    leaving = frame;
                    isWaiting = false;
                    open = transport;
                    outstanding.Add(leaving.Sequence);
                    Sent++;
                }
                try
                {
                    open.Send(leaving.Buffer, Headroom.Bytes, leaving.Bytes, false);
                }
                catch (Exception error) when (IsConnection(error))
                {
                    // The receiver sees the same end, tells what was lost and connects anew.
                    open.Dispose();
                }
            }
        }

        static bool IsConnection(Exception error)
        {
            return error is IOException || error is SocketException || error is ObjectDisposedException || error is InvalidOperationException || error is System.Security.Authentication.AuthenticationException;
        }

        void Receive()
        {
            while (true)
            {
                var next = newTransport();
                lock (gate)
                {
                    if (isClosed) return;
                }
                try
                {
                    next.Connect(uri, AttemptMs);
                    lock (gate) transport = next;
                    Greet(next);
                    Listen(next);
                }
                catch (Exception error) when (IsConnection(error) || error is FormatException)
                {
                    var fault = error is FormatException ? Refused : null;
                    if (fault != null) fault(new Problem("bad_frame", error.Message));
                }
                next.Dispose();
                lock (gate)
                {
                    transport = null;
                    ready = null;
                    helloBefore = null;
                    while (isRefused && !isClosed) Monitor.Wait(gate);
                }
                LoseAll();
                Thread.Sleep(RetryLeastMs + random.Next(RetryMostMs - RetryLeastMs));
            }
        }

        void Greet(ITransport open)
        {
            var text = Encoding.UTF8.GetBytes(hello.ToText());
            var buffer = new byte[Headroom.Bytes + text.Length];
            text.CopyTo(buffer, Headroom.Bytes);
            try
            {
                open.Send(buffer, Headroom.Bytes, text.Length, true);
            }
            catch (Exception error) when (IsConnection(error))
            {
                open.Dispose();
            }
        }

        void Listen(ITransport open)
        {
            while (true)
            {
                bool isText;
                int bytes = open.Receive(message, out isText);
                if (bytes < 0) return;
                if (!isText) OnFrame(bytes);
                else if (!OnText(JObject.Parse(Encoding.UTF8.GetString(message, 0, bytes)))) return;
            }
        }

        /// <summary>False where the session cannot go on.</summary>
        bool OnText(JObject json)
        {
            if ((string)json["type"] == "ready")
            {
                var terms = new Ready(json);
                lock (gate)
                {
                    olderTerms = readyBefore;
                    readyBefore = null;
                    helloBefore = null;
                    ready = terms;
                    Monitor.PulseAll(gate);
                }
                var welcome = SessionReady;
                if (welcome != null) welcome(terms);
                return true;
            }
            var problem = new Problem(json);
            bool isOurs;
            if (problem.Sequence != null)
            {
                lock (gate) isOurs = outstanding.Remove(problem.Sequence.Value);
                if (isOurs) Tell(problem.Sequence.Value, Status.Error, problem);
                return true;
            }
            bool goesOn = OnRefusal(problem);
            var refused = Refused;
            if (refused != null) refused(problem);
            return goesOn;
        }

        /// <summary>A refused renewal leaves the old terms; a refused first hello ends it, unless the reason passes by itself.</summary>
        bool OnRefusal(Problem problem)
        {
            bool passes = problem.Closes || problem.Code == "overloaded" || problem.Code == "internal" || problem.Code == "rate_limited";
            lock (gate)
            {
                if (ready != null || passes) return true;
                if (helloBefore != null)
                {
                    hello = helloBefore;
                    ready = readyBefore;
                    helloBefore = null;
                    readyBefore = null;
                    return true;
                }
                refusal = problem;
                isRefused = true;
                Monitor.PulseAll(gate);
                return false;
            }
        }

        void OnFrame(int bytes)
        {
            uint answered = Answer.PeekSequence(message, bytes);
            Ready terms;
            lock (gate)
            {
                if (!outstanding.Remove(answered)) return;
                bool isOlder = olderTerms != null && (int)(answered - termsFrom) < 0;
                if (!isOlder) olderTerms = null;
                terms = isOlder ? olderTerms : ready ?? readyBefore;
                if (terms == null) return;
                Monitor.PulseAll(gate);
            }
            lock (telling)
            {
                filling.Read(message, bytes, terms);
                filling.RoundTripUs = (long)(ClockUs() - filling.ClientTimeUs);
                var answeredEvent = Answered;
                if (answeredEvent != null) answeredEvent(filling);
                if (filling.Status != Status.Ok) return;
                var old = newest;
                newest = filling;
                filling = old;
                isFresh = true;
            }
        }

        void Tell(uint sequence, Status status, Problem problem)
        {
            lock (telling)
            {
                brief.Sequence = sequence;
                brief.Status = status;
                brief.Problem = problem;
                var answered = Answered;
                if (answered != null) answered(brief);
            }
        }

        /// <summary>What went out on a lost connection is never answered.</summary>
        void LoseAll()
        {
            while (true)
            {
                uint lost = 0;
                lock (gate)
                {
                    if (outstanding.Count == 0) return;
                    foreach (uint one in outstanding)
                    {
                        lost = one;
                        break;
                    }
                    outstanding.Remove(lost);
                }
                Tell(lost, Status.Lost, null);
            }
        }

        /// <summary>Ends the session. Frames without an answer are lost.</summary>
        public void Dispose()
        {
            lock (gate)
            {
                if (isClosed) return;
                isClosed = true;
                if (transport != null) transport.Dispose();
                Monitor.PulseAll(gate);
            }
            if (receiver == null) return;
            if (Thread.CurrentThread != receiver) receiver.Join(2 * AttemptMs);
            if (Thread.CurrentThread != sender) sender.Join(AttemptMs);
            LoseAll();
            if (isWaiting) Tell(waiting.Sequence, Status.Lost, null);
        }
    }
}
