"""Messages and stubs that protoc makes of proto/relmap/v1 (client/python/update_stubs)."""
