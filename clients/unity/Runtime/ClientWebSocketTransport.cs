using System;
using System.IO;
using System.Net.WebSockets;
using System.Threading;
using System.Threading.Tasks;

namespace Papilla
{
    /// <summary>
    /// The framework's own WebSocket, for networks whose proxy it must pass. Nagle's algorithm is what the framework
    /// chose (off in .NET, on in Mono), and every message allocates a little: prefer <see cref="SocketTransport"/>.
    /// </summary>
    public sealed class ClientWebSocketTransport : ITransport
    {
        readonly ClientWebSocket socket = new ClientWebSocket();
        int isDisposed;
        readonly CancellationTokenSource ended = new CancellationTokenSource();

        /// <inheritdoc/>
        public void Connect(Uri uri, int timeoutMs)
        {
            socket.Options.SetBuffer(65536, 65536);
            var connecting = socket.ConnectAsync(uri, ended.Token);
            if (!Wait(connecting, timeoutMs)) throw new IOException("no connection to " + uri.Host + " within " + timeoutMs + " ms");
        }

        /// <inheritdoc/>
        public void Send(byte[] buffer, int offset, int count, bool isText)
        {
            var type = isText ? WebSocketMessageType.Text : WebSocketMessageType.Binary;
            Wait(socket.SendAsync(new ArraySegment<byte>(buffer, offset, count), type, true, ended.Token), Timeout.Infinite);
        }

        /// <inheritdoc/>
        public int Receive(byte[] buffer, out bool isText)
        {
            int length = 0;
            while (true)
            {
                var receiving = socket.ReceiveAsync(new ArraySegment<byte>(buffer, length, buffer.Length - length), ended.Token);
                Wait(receiving, Timeout.Infinite);
                isText = receiving.Result.MessageType == WebSocketMessageType.Text;
                if (receiving.Result.MessageType == WebSocketMessageType.Close) return -1;
                length += receiving.Result.Count;
                if (receiving.Result.EndOfMessage) return length;
            }
        }

        /// <summary>Waits; the one fault inside is thrown as an IOException.</summary>
        static bool Wait(Task task, int timeoutMs)
        {
            try
            {
                return task.Wait(timeoutMs);
            }
            catch (AggregateException error)
            {
                throw new IOException(error.GetBaseException().Message, error.GetBaseException());
            }
        }

        /// <inheritdoc/>
        public void Dispose()
        {
            if (Interlocked.Exchange(ref isDisposed, 1) != 0) return;
            ended.Cancel();
            socket.Dispose();
        }
    }
}
