using System;

namespace Papilla
{
    /// <summary>One WebSocket. Sending and receiving may run on two threads; nothing is allocated for a message.</summary>
    public interface ITransport : IDisposable
    {
        /// <summary>Connects; throws an IOException or SocketException that says why not.</summary>
        void Connect(Uri uri, int timeoutMs);

        /// <summary>
        /// Sends one message. The <see cref="Headroom"/> bytes before <paramref name="offset"/> and the message itself
        /// may be overwritten.
        /// </summary>
        void Send(byte[] buffer, int offset, int count, bool isText);

        /// <summary>Receives one message into <paramref name="buffer"/>: its length, or -1 at the end of the connection.</summary>
        int Receive(byte[] buffer, out bool isText);
    }

    /// <summary>What senders leave free before a message.</summary>
    public static class Headroom
    {
        /// <summary>The longest head of a client's WebSocket frame, bytes.</summary>
        public const int Bytes = 14;
    }
}
