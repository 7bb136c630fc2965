using System;
using System.Diagnostics;
using System.Text;
using System.Threading;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <content>
    /// Going on over another connection when the service asks for it. A third thread opens it while frames go on over the old one; then
    /// they wait until the old one has said what the service remembers, sealed, and the new one is ready.
    /// </content>
    public sealed partial class Session
    {
        const int MovePatienceMs = 5000;

        enum Stage { Dialling, SealDue, Held, Sealed }

        /// <summary>A move that is under way; with the gate held.</summary>
        sealed class Move
        {
            internal Stage Stage;
            internal ITransport Next;
            internal Hello Hello;
            internal byte[] State;
            // Why it is given up; null: it is not.
            internal string Stays;
            internal bool Holds { get { return Stage == Stage.Held || Stage == Stage.Sealed; } }
        }

        // Null: none.
        Move move;
        Thread mover;
        // States that were asked for and have not come: one that comes after its patience is not that of the last one asked for.
        int sealsDue;

        void OnReconnect()
        {
            lock (gate)
            {
                if (move != null || isClosed) return;
                var own = new Move();
                move = own;
                mover = new Thread(() => Follow(own)) { IsBackground = true, Name = "papilla move" };
            }
            mover.Start();
        }

        /// <summary>Tries until the session has moved, or its old connection is gone.</summary>
        void Follow(Move own)
        {
            while (true)
            {
                var next = newTransport();
                bool isDone = false;
                try
                {
                    next.Connect(uri, AttemptMs);
                    isDone = Attempt(own, next);
                }
                catch (Exception error) when (IsConnection(error) || error is FormatException || error is PapillaException)
                {
                    // The old connection goes on for as long as it is there.
                }
                if (isDone) return;
                next.Dispose();
                string stays;
                lock (gate)
                {
                    if (isClosed || move != own) return;
                    stays = own.Stays;
                    if (stays != null) move = null;
                    Monitor.PulseAll(gate);
                }
                if (stays != null)
                {
                    var words = "the service asked the session to move, and did not say what it remembers (" + stays + "): it goes on over its old connection, and starts anew when that ends";
                    if (IsNew(words)) TellPeople(words);
                    return;
                }
                lock (gate)
                {
                    if (isClosed || move != own) return;
                    own.Stage = Stage.Dialling;
                    own.Next = null;
                    Monitor.PulseAll(gate);
                }
                Thread.Sleep(RetryMostMs);
            }
        }

        bool Attempt(Move own, ITransport next)
        {
            lock (gate)
            {
                if (isClosed || move != own) return false;
                own.Next = next;
                own.Stage = Stage.SealDue;
                Monitor.PulseAll(gate);
                var watch = Stopwatch.StartNew();
                while (move == own && own.Next == next && own.Stage != Stage.Sealed)
                {
                    int left = MovePatienceMs - (int)watch.ElapsedMilliseconds;
                    if (left <= 0 && own.Stays == null) own.Stays = "nothing came within " + MovePatienceMs / 1000 + " s";
                    if (own.Stays != null || isClosed) return false;
                    Monitor.Wait(gate, left);
                }
                if (move != own || own.Next != next) return false;
            }
            Ready terms;
            // Disposing it ends the wait for its ready.
            using (new Timer(late => next.Dispose(), null, MovePatienceMs, Timeout.Infinite)) terms = Resume(own, next);
            return terms != null && Adopt(own, next, terms);
        }

        /// <summary>Says hello with what the service remembers; null where that is refused.</summary>
        static Ready Resume(Move own, ITransport next)
        {
            SendText(next, own.Hello.ToText(true, true));
            var buffer = new byte[Headroom.Bytes + own.State.Length];
            own.State.CopyTo(buffer, Headroom.Bytes);
            next.Send(buffer, Headroom.Bytes, own.State.Length, false);
            bool isText;
            var answer = new byte[Wire.MessageBytesMax];
            int bytes = next.Receive(answer, out isText);
            if (bytes < 0 || !isText) return null;
            var json = JObject.Parse(Encoding.UTF8.GetString(answer, 0, bytes));
            return (string)json["type"] == "ready" ? new Ready(json) : null;
        }

        bool Adopt(Move own, ITransport next, Ready terms)
        {
            ITransport old;
            lock (gate)
            {
                if (isClosed || move != own || own.Next != next) return false;
                old = transport;
                transport = next;
                ready = terms;
                move = null;
                Connections++;
                Monitor.PulseAll(gate);
            }
            // The receiver wakes, and goes on with the other.
            old.Dispose();
            var welcome = SessionReady;
            if (welcome != null) welcome(terms);
            return true;
        }

        /// <summary>Lets the old connection go on: what was sealed is of terms that no longer hold. With the gate held.</summary>
        void PutOffMove()
        {
            if (move == null || move.Stage == Stage.Dialling) return;
            move.Stage = Stage.Dialling;
            move.Next = null;
            Monitor.PulseAll(gate);
        }

        /// <summary>Whether a refusal is in place of a seal, while nothing else is asked for; the move is then given up.</summary>
        bool IsOfSeal(Problem problem)
        {
            lock (gate)
            {
                if (move == null || move.Stage != Stage.Held) return false;
                if (--sealsDue > 0) return true;
                move.Stays = problem.Message;
                Monitor.PulseAll(gate);
                return true;
            }
        }

        void OnSealed(int bytes)
        {
            lock (gate)
            {
                if (--sealsDue > 0 || move == null || move.Stage != Stage.Held) return;
                move.State = new byte[bytes];
                Array.Copy(message, move.State, bytes);
                move.Stage = Stage.Sealed;
                Monitor.PulseAll(gate);
            }
        }
    }
}
