"""Films with known truth, and the accuracy of their tracks.

- `rink`, `people`, `render`: films of known throws by a renderer that shares no code with the
  project
- `accuracy`: tracks of films compared with the truth, and coarse copies of films
- `practice`: an hour of practice, joined from such films
- `takeouts`: takeouts, rendered by the package
- `live`: a camera that sends its film in real time
"""
