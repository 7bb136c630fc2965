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
                        move.Asked++;
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
            leaving.StampVersion(ready.Version);
            of.IsWaiting = false;
            outstanding.Add(leaving.Sequence);
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
                catch (Exception error) when (IsConnection(error))
                {
                    next.Dispose();
                }
                lock (gate)
                {
                    transport = null;
                    ready = null;
                    helloBefore = null;
                    move = null;
                    Monitor.PulseAll(gate);
                    while (isRefused && !isClosed) Monitor.Wait(gate);
                }
                LoseAll();
                Thread.Sleep(RetryLeastMs + random.Next(RetryMostMs - RetryLeastMs));
            }
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
            bool isOurs;
            if (problem.Sequence != null)
            {
                lock (gate) isOurs = outstanding.Remove(problem.Sequence.Value);
                if (isOurs) WarnOnce(ref toldRefusal, "a frame was refused: " + problem.Message);
                if (isOurs) Tell(problem.Sequence.Value, Status.Error, problem);
                return true;
            }
            bool goesOn = OnRefusal(problem);
            if (!goesOn) WarnOnce(ref toldRefusal, "the session was refused: " + problem.Message);
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
                bool isOlder = olderReady != null && (int)(answered - renewedFrom) < 0;
                if (!isOlder) olderReady = null;
                terms = isOlder ? olderReady : ready ?? readyBefore;
                if (terms == null) return;
                Monitor.PulseAll(gate);
            }
            lock (telling)
            {
                filling.Read(message, bytes, terms);
                if (filling.OutOfRange && filling.Status == Status.Ok) WarnOnce(ref toldRange, "pressure is beyond what the tier knows; such answers are flagged");
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
    }
}
