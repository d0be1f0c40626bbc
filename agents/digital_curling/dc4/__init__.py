"""Digital Curling 4: the same games over HTTP, with server-sent events.

- `messages`: its states and shots, and how they read in the words of version 3
- `join`: a client
- `seat`: a client's seat at a host
- `application`: a host's pages and answers
"""
