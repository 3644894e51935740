//! Connections that nobody holds open for nothing.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::serve::Listener;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep};

/// A listener whose connections end when nothing could be sent for the time `limit`:
/// half-open and stalled ones, slow requests, and clients that read no more. A client
/// that reads is sent the state of the source ten times a second.
pub(crate) struct Limited {
    pub(crate) listener: TcpListener,
    pub(crate) limit: Duration,
}

impl Listener for Limited {
    type Io = Connection;
    type Addr = std::net::SocketAddr;

    async fn accept(&mut self) -> (Self::Io, Self::Addr) {
        let (stream, address) = Listener::accept(&mut self.listener).await;
        // A frame must not wait until the client has acknowledged the one before.
        let _ = stream.set_nodelay(true);
        (Connection::new(stream, self.limit), address)
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        self.listener.local_addr()
    }
}

/// A connection with the time by which something must have been sent.
pub(crate) struct Connection {
    stream: TcpStream,
    limit: Duration,
    end: Pin<Box<Sleep>>,
}

impl Connection {
    fn new(stream: TcpStream, limit: Duration) -> Self {
        Self {
            stream,
            limit,
            end: Box::pin(tokio::time::sleep(limit)),
        }
    }

    /// An error when the time is over.
    fn in_time(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        match self.end.as_mut().poll(context) {
            Poll::Ready(()) => Err(io::ErrorKind::TimedOut.into()),
            Poll::Pending => Ok(()),
        }
    }

    fn sent(&mut self, sent: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        if let Poll::Ready(Ok(1..)) = sent {
            self.end.as_mut().reset(Instant::now() + self.limit);
        }
        sent
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.in_time(context)?;
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.in_time(context)?;
        let sent = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.sent(sent)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        pieces: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.in_time(context)?;
        let sent = Pin::new(&mut self.stream).poll_write_vectored(context, pieces);
        self.sent(sent)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};

    use axum::Router;
    use axum::routing::get;

    use super::*;

    /// Bytes of the answer to `request`, once the server has closed the connection.
    fn answer(request: &str) -> (usize, Duration) {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0")).unwrap();
        let address = listener.local_addr().unwrap();
        let limit = Duration::from_millis(300);
        let router = Router::new().route("/", get(|| async { "here" }));
        runtime.spawn(async move { axum::serve(Limited { listener, limit }, router).await });
        let mut client = std::net::TcpStream::connect(address).unwrap();
        client
            .set_read_timeout(Some(Duration::from_secs(20)))
            .unwrap();
        client.write_all(request.as_bytes()).unwrap();
        let start = std::time::Instant::now();
        let mut read = Vec::new();
        // A reset is an end as well; a time-out of this side is not.
        if let Err(error) = client.read_to_end(&mut read) {
            assert_eq!(error.kind(), io::ErrorKind::ConnectionReset);
        }
        (read.len(), start.elapsed())
    }

    #[test]
    fn a_client_that_reads_no_more_is_dropped() {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        let ended = runtime.block_on(async {
            let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
            let limit = Duration::from_millis(300);
            let (mut connection, _) = Limited { listener, limit }.accept().await;
            let bytes = [0; 1 << 12];
            loop {
                let write = |context: &mut Context<'_>| {
                    Pin::new(&mut connection).poll_write(context, &bytes)
                };
                if let Err(error) = std::future::poll_fn(write).await {
                    drop(client);
                    break error.kind();
                }
            }
        });
        assert_eq!(ended, io::ErrorKind::TimedOut);
    }

    #[test]
    fn half_open_and_idle_connections_are_dropped() {
        let whole = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
        for (request, answered) in [("", false), ("GET / HT", false), (whole, true)] {
            let (bytes, elapsed) = answer(request);
            assert_eq!(bytes > 0, answered, "{request}");
            assert!(elapsed > Duration::from_millis(200), "{elapsed:?}");
        }
    }
}
