using System;
using System.Globalization;
using System.IO;
using System.Net.Security;
using System.Net.Sockets;
using System.Security.Cryptography;
using System.Text;
using System.Threading;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>
    /// A WebSocket client (RFC 6455) over a blocking socket. <c>ClientWebSocket</c> hides its socket: neither Nagle's algorithm nor the
    /// socket's buffers can be set there, and it allocates for every message. Here Nagle is off, both buffers have 512 KiB before the
    /// connection is made, and a message costs no allocation.
    /// </summary>
    public sealed class SocketTransport : ITransport
    {
        const int SocketBufferBytes = 512 * 1024;
        const int ContinuationFrame = 0, TextFrame = 1, BinaryFrame = 2, CloseFrame = 8, PingFrame = 9, PongFrame = 10;

        readonly byte[] head = new byte[8];
        readonly byte[] control = new byte[Headroom.Bytes + 125];
        readonly byte[] mask = new byte[4];
        readonly object sending = new object();
        readonly Random random = new Random();
        Socket socket;
        SslStream tls;
        int isDisposed;

        /// <inheritdoc/>
        public void Connect(Uri uri, int timeoutMs)
        {
            socket = new Socket(SocketType.Stream, ProtocolType.Tcp) { NoDelay = true, SendBufferSize = SocketBufferBytes, ReceiveBufferSize = SocketBufferBytes };
            socket.SendTimeout = 0;
            var pending = socket.BeginConnect(uri.DnsSafeHost, uri.Port, null, null);
            if (!pending.AsyncWaitHandle.WaitOne(timeoutMs)) throw new IOException("no connection to " + uri.Host + " within " + timeoutMs + " ms");
            socket.EndConnect(pending);
            socket.ReceiveTimeout = timeoutMs;
            if (uri.Scheme == "wss")
            {
                tls = new SslStream(new NetworkStream(socket));
                tls.AuthenticateAsClient(uri.DnsSafeHost);
            }
            Upgrade(uri);
            socket.ReceiveTimeout = 0;
        }

        void Upgrade(Uri uri)
        {
            var nonce = new byte[16];
            using (var generator = RandomNumberGenerator.Create()) generator.GetBytes(nonce);
            var key = Convert.ToBase64String(nonce);
            var request = Encoding.ASCII.GetBytes("GET " + uri.PathAndQuery + " HTTP/1.1\r\nHost: " + uri.Authority
                + "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: " + key + "\r\nSec-WebSocket-Version: 13\r\n\r\n");
            Write(request, 0, request.Length);
            var reply = new StringBuilder();
            while (!EndsWith(reply, "\r\n\r\n"))
            {
                if (reply.Length > 16384 || Read(head, 0, 1) == 0) throw new IOException("the answer to the upgrade breaks off: " + reply);
                reply.Append((char)head[0]);
            }
            var text = reply.ToString();
            string due;
            using (var sha = SHA1.Create()) due = Convert.ToBase64String(sha.ComputeHash(Encoding.ASCII.GetBytes(key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11")));
            if (!text.StartsWith("HTTP/1.1 101", StringComparison.Ordinal)) throw Refusal(text);
            if (text.IndexOf(due, StringComparison.Ordinal) < 0) throw new IOException("the answer to the upgrade is of no WebSocket");
        }

        /// <summary>Why the server did not upgrade: its own words, where its answer has a body.</summary>
        Exception Refusal(string reply)
        {
            var body = new StringBuilder();
            const string length = "content-length: ";
            int at = reply.ToLowerInvariant().IndexOf(length, StringComparison.Ordinal), due = 0;
            if (at >= 0) int.TryParse(reply.Substring(at + length.Length).Split('\r')[0], NumberStyles.None, CultureInfo.InvariantCulture, out due);
            while (body.Length < Math.Min(due, 4096) && Read(head, 0, 1) == 1) body.Append((char)head[0]);
            try
            {
                return new PapillaException(new Problem((JObject)JObject.Parse(body.ToString())["error"]));
            }
            catch (Exception error) when (error is Newtonsoft.Json.JsonException || error is InvalidCastException || error is NullReferenceException)
            {
                return new IOException("no session: " + reply.Split('\r')[0]);
            }
        }

        static bool EndsWith(StringBuilder text, string end)
        {
            if (text.Length < end.Length) return false;
            for (int k = 0; k < end.Length; k++) if (text[text.Length - end.Length + k] != end[k]) return false;
            return true;
        }

        /// <inheritdoc/>
        public void Send(byte[] buffer, int offset, int count, bool isText)
        {
            SendFrame(buffer, offset, count, isText ? TextFrame : BinaryFrame);
        }

        unsafe void SendFrame(byte[] buffer, int offset, int count, int opcode)
        {
            lock (sending)
            {
                random.NextBytes(mask);
                int at = offset - 4;
                for (int k = 0; k < 4; k++) buffer[at + k] = mask[k];
                int length = count < 126 ? count : count < 65536 ? 126 : 127;
                int extra = length < 126 ? 0 : length == 126 ? 2 : 8;
                for (int k = 0; k < extra; k++) buffer[--at] = (byte)((ulong)count >> (8 * k));
                buffer[--at] = (byte)(0x80 | length);
                buffer[--at] = (byte)(0x80 | opcode);
                Mask(buffer, offset, count);
                Write(buffer, at, offset + count - at);
            }
        }

        unsafe void Mask(byte[] buffer, int offset, int count)
        {
            uint four = (uint)(mask[0] | mask[1] << 8 | mask[2] << 16 | mask[3] << 24);
            ulong eight = four | (ulong)four << 32;
            int whole = count / 8;
            fixed (byte* first = buffer)
            {
                var words = (ulong*)(first + offset);
                for (int k = 0; k < whole; k++) words[k] ^= eight;
                for (int k = 8 * whole; k < count; k++) first[offset + k] ^= mask[k & 3];
            }
        }

        /// <inheritdoc/>
        public int Receive(byte[] buffer, out bool isText)
        {
            isText = false;
            int length = 0;
            while (true)
            {
                if (!ReadAll(head, 0, 2)) return -1;
                int opcode = head[0] & 15;
                bool isLast = (head[0] & 0x80) != 0;
                long due = head[1] & 127;
                if ((head[1] & 0x80) != 0) throw new IOException("a masked frame from the server");
                int extra = due < 126 ? 0 : due == 126 ? 2 : 8;
                if (extra > 0)
                {
                    if (!ReadAll(head, 0, extra)) return -1;
                    due = 0;
                    for (int k = 0; k < extra; k++) due = due << 8 | head[k];
                }
                if (opcode >= CloseFrame)
                {
                    if (!Control(opcode, (int)due)) return -1;
                    continue;
                }
                if (opcode != ContinuationFrame) isText = opcode == TextFrame;
                if (length + due > buffer.Length) throw new IOException("a message of more than " + buffer.Length + " bytes");
                if (!ReadAll(buffer, length, (int)due)) return -1;
                length += (int)due;
                if (isLast) return length;
            }
        }

        /// <summary>Answers a ping, and a close; false once the connection ends.</summary>
        bool Control(int opcode, int count)
        {
            if (count > 125 || !ReadAll(control, Headroom.Bytes, count)) return false;
            if (opcode == PingFrame) SendFrame(control, Headroom.Bytes, count, PongFrame);
            if (opcode != CloseFrame) return true;
            SendFrame(control, Headroom.Bytes, count, CloseFrame);
            return false;
        }

        bool ReadAll(byte[] buffer, int offset, int count)
        {
            while (count > 0)
            {
                int read = Read(buffer, offset, count);
                if (read == 0) return false;
                offset += read;
                count -= read;
            }
            return true;
        }

        int Read(byte[] buffer, int offset, int count)
        {
            return tls != null ? tls.Read(buffer, offset, count) : socket.Receive(buffer, offset, count, SocketFlags.None);
        }

        void Write(byte[] buffer, int offset, int count)
        {
            if (tls != null)
            {
                tls.Write(buffer, offset, count);
                return;
            }
            while (count > 0)
            {
                int sent = socket.Send(buffer, offset, count, SocketFlags.None);
                offset += sent;
                count -= sent;
            }
        }

        /// <inheritdoc/>
        public void Dispose()
        {
            if (socket == null || Interlocked.Exchange(ref isDisposed, 1) != 0) return;
            // Wakes a thread that waits in Receive or Send.
            try { socket.Shutdown(SocketShutdown.Both); } catch (SocketException) { /* it was never connected, or is gone */ }
            socket.Close();
        }
    }
}
