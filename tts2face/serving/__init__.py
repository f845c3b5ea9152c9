"""The server side: batches, durable work, the HTTP service and the studio."""
