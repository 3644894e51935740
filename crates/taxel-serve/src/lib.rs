//! Live sources, HTTP and WebSocket service, and the page.
