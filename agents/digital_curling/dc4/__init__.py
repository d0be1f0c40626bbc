"""Digital Curling 4: the same games over HTTP, with server-sent events.

- `messages`: its states and shots, and their conversion to version 3
- `join`: a client
- `seat`: a client's seat at a host
- `application`: pages and answers of a host
"""
