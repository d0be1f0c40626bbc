"""Films whose truth is known, and how far tracks of them lie from it.

- `rink`, `people`, `render`: films of known throws by a renderer that shares no code with the
  project
- `accuracy`: tracks of films beside the truth, and coarse copies of films
- `practice`: an hour of practice, joined from such films
- `takeouts`: takeouts, rendered by the package
- `live`: a camera that sends its film at its own pace
"""
