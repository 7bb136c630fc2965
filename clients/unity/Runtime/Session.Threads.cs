using System;
using System.IO;
using System.Net.Sockets;
using System.Text;
using System.Threading;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <content>The two threads: one sends the frame that waits, the other connects and receives.</content>
    public sealed partial class Session
    {
        /// <summary>A frame that has left.</summary>
        struct Left
        {
            internal ulong BornUs;
            internal int Finger;
        }

        static readonly string[] Passing = { "overloaded", "internal", "rate_limited", "shutting_down", "timeout" };

        int isExpiring;

        void SendWaiting()
        {
            while (true)
            {
                ITransport open;
                bool isSeal;
                lock (gate)
                {
                    Finger next = null;
                    while (!isClosed && (!CanSend() || !IsSealDue() && (next = NextWaiting()) == null)) Monitor.Wait(gate);
                    if (isClosed) return;
                    open = transport;
                    if (next == null)
                    {
                        move.Stage = Stage.Held;
                        move.Hello = hello;
                        sealsDue++;
                    }
                    else
                    {
                        TakeWaiting(next);
                    }
                    isSeal = next == null;
                }
                try
                {
                    if (isSeal) SendText(open, "{\"type\": \"seal\"}");
                    else open.Send(leaving.Buffer, Headroom.Bytes, leaving.Bytes, false);
                }
                catch (Exception error) when (IsConnection(error))
                {
                    // The receiver sees the same end, tells what was lost and connects anew.
                    open.Dispose();
                }
            }
        }

        bool CanSend()
        {
            return ready != null && transport != null && outstanding.Count < OutstandingMax && (move == null || !move.Holds);
        }

        bool IsSealDue()
        {
            return move != null && move.Stage == Stage.SealDue;
        }

        void TakeWaiting(Finger of)
        {
            var frame = of.Waiting;
            of.Waiting = leaving;
            leaving = frame;
            of.IsWaiting = false;
            outstanding.Add(leaving.Sequence, new Left { BornUs = of.BornUs, Finger = of.Number });
            Sent++;
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
                    lock (gate)
                    {
                        transport = next;
                        isFirstReady = true;
                    }
                    Greet(next);
                    Attend(next);
                }
                catch (Exception error) when (IsConnection(error) || error is PapillaException)
                {
                    next.Dispose();
                    OnFailed(error);
                }
                lock (gate)
                {
                    transport = null;
                    ready = null;
                    helloBefore = null;
                    move = null;
                    sealsDue = 0;
                    Monitor.PulseAll(gate);
                    while (isRefused && !isClosed) Monitor.Wait(gate);
                }
                LoseAll();
                Thread.Sleep(RetryLeastMs + random.Next(RetryMostMs - RetryLeastMs));
            }
        }

        /// <summary>An attempt to connect failed; a refusal that does not pass by itself ends the session.</summary>
        void OnFailed(Exception error)
        {
            var refused = error as PapillaException;
            lock (gate) fault = error.Message;
            if (refused == null || OnRefusal(refused.Problem)) return;
            string hint = refused.Problem.Code == "unauthorized" ? "; here as the session's third argument" : "";
            if (IsNew("refused")) TellPeople("the session was refused: " + refused.Problem.Message + hint);
            var told = Refused;
            if (told != null) told(refused.Problem);
        }

        /// <summary>Listens to a connection, and to the one that the session moves to, until the session has none.</summary>
        void Attend(ITransport open)
        {
            while (true)
            {
                try
                {
                    Listen(open);
                }
                catch (Exception error) when (IsConnection(error) || error is FormatException)
                {
                    var fault = error is FormatException ? Refused : null;
                    if (fault != null) fault(new Problem("bad_frame", error.Message));
                }
                open.Dispose();
                lock (gate)
                {
                    if (isClosed || transport == open) return;
                    open = transport;
                }
            }
        }

        static void SendText(ITransport open, string words)
        {
            var text = Encoding.UTF8.GetBytes(words);
            var buffer = new byte[Headroom.Bytes + text.Length];
            text.CopyTo(buffer, Headroom.Bytes);
            open.Send(buffer, Headroom.Bytes, text.Length, true);
        }

        void Greet(ITransport open)
        {
            try
            {
                SendText(open, hello.ToText(true));
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
                if (!isText && Wire.IsSealed(message, bytes)) OnSealed(bytes);
                else if (!isText) OnFrame(bytes);
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
                    olderReady = readyBefore;
                    readyBefore = null;
                    helloBefore = null;
                    ready = terms;
                    if (isFirstReady) Connections++;
                    isFirstReady = false;
                    Monitor.PulseAll(gate);
                }
                Question(terms);
                var welcome = SessionReady;
                if (welcome != null) welcome(terms);
                return true;
            }
            if ((string)json["type"] == "reconnect")
            {
                OnReconnect();
                return true;
            }
            var problem = new Problem(json);
            if (problem.Sequence != null)
            {
                Left left;
                bool isOurs;
                lock (gate)
                {
                    isOurs = outstanding.TryGetValue(problem.Sequence.Value, out left);
                    outstanding.Remove(problem.Sequence.Value);
                }
                if (isOurs && IsNew("error")) TellPeople("a frame was refused: " + problem.Message);
                if (isOurs) Tell(problem.Sequence.Value, left.Finger, Status.Error, problem);
                return true;
            }
            if (IsOfSeal(problem)) return true;
            bool goesOn = OnRefusal(problem);
            if (!goesOn && IsNew("refused")) TellPeople("the session was refused: " + problem.Message);
            var refused = Refused;
            if (refused != null) refused(problem);
            return goesOn;
        }

        /// <summary>A refused renewal leaves the old terms; a refused first hello ends it, unless the reason passes by itself.</summary>
        bool OnRefusal(Problem problem)
        {
            bool passes = problem.Closes || Array.IndexOf(Passing, problem.Code) >= 0;
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
                bool isOlder = olderReady != null && (int)(answered - renewedFrom) < 0;
                if (!isOlder) olderReady = null;
                terms = isOlder ? olderReady : ready ?? readyBefore;
                if (terms == null) return;
                Monitor.PulseAll(gate);
            }
            lock (telling)
            {
                filling.Read(message, bytes, terms);
                if (filling.OutOfRange && filling.Status == Status.Ok && IsNew("out_of_range")) TellPeople("pressure is beyond what the tier knows; such answers are flagged");
                if (filling.CoarseClock && filling.Status == Status.Ok && IsNew("coarse_clock")) TellPeople("the times of the frames have steps above 20 ms, stand still, or are in ms or ns in place of us; rates, spikes and creep in such answers are wrong, and flagged coarse_clock");
                filling.RoundTripUs = (long)(ClockUs() - filling.ClientTimeUs);
                var answeredEvent = Answered;
                if (answeredEvent != null) answeredEvent(filling);
                if (filling.Status != Status.Ok) return;
                var of = fingers[filling.Finger];
                var old = of.Newest;
                of.Newest = filling;
                of.IsFresh = true;
                filling = old;
            }
        }

        void Tell(uint sequence, int finger, Status status, Problem problem)
        {
            lock (telling)
            {
                brief.Sequence = sequence;
                brief.Finger = finger;
                brief.Status = status;
                brief.Problem = problem;
                var answered = Answered;
                if (answered != null) answered(brief);
            }
        }

        /// <summary>What went out on a lost connection is never answered.</summary>
        void LoseAll()
        {
            LoseLeft(ulong.MaxValue);
        }

        /// <summary>Loses what left and was handed over by then; false: there was none.</summary>
        bool LoseLeft(ulong bornUs)
        {
            bool any = false;
            while (true)
            {
                uint lost = 0;
                int finger = 0;
                bool isOver = true;
                lock (gate)
                {
                    foreach (var one in outstanding)
                    {
                        if (one.Value.BornUs > bornUs) continue;
                        lost = one.Key;
                        finger = one.Value.Finger;
                        isOver = false;
                        break;
                    }
                    if (isOver) return any;
                    outstanding.Remove(lost);
                    any = true;
                }
                Tell(lost, finger, Status.Lost, null);
            }
        }

        /// <summary>Ends frames whose time is over; on a thread of the system's, since the others may wait for the socket.</summary>
        void Expire()
        {
            if (Interlocked.Exchange(ref isExpiring, 1) != 0) return;
            ulong now = Now(), timeoutUs = 1000 * (ulong)Math.Max(1, TimeoutMs);
            ulong bornUs = now > timeoutUs ? now - timeoutUs : 0;
            ITransport open;
            lock (gate) open = transport;
            bool waited = EndWaiting(Status.Lost, bornUs), left = LoseLeft(bornUs);
            if ((waited || left) && IsNew("timeout")) TellPeople("no answer within " + TimeoutMs + " ms; such frames are lost");
            // A server that stopped, or a network that is gone: nothing more will come of this connection.
            if (left && open != null) open.Dispose();
            isExpiring = 0;
        }
    }
}
