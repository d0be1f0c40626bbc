"""Digital Curling: the effect of a shot as on its server, in the server's own JSON."""

from agents.digital_curling.transition import transition
from curling_env.infrastructure.lazy_names import lazy_names

__all__ = ["transition"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "client": ("Client",),
        "conversation": ("PlayerMessage", "Update", "from_server", "write_line"),
        "conversion": ("game_of", "move_of", "rules_of", "skill_of", "throw_of"),
        "dc4.application": ("Credentials", "RateLimit"),
        "dc4.join": ("Connection4", "Place4", "play_on_web_server"),
        "dc4.match": ("RefusedError", "doubles_of"),
        "dc4.messages": (
            "Reader4",
            "Shot4",
            "State4",
            "move_from",
            "placement_of",
            "request_of",
            "shot_of",
            "state_of",
        ),
        "dc4.web_host": ("host_on_the_web", "read_passwords"),
        "game_record": ("record_of",),
        "hosting.hosted_game": ("HostedGame",),
        "hosting.seats": (
            "ClientSeat",
            "MAX_BAD_LINES",
            "OutOfTimeError",
            "PlayerSeat",
            "SeatLostError",
            "Turn",
        ),
        "hosting.server": ("Hosting", "host_game"),
        "hosting.setting": ("HostSetting", "throwers_from"),
        "join": ("WireLog", "address_of", "play_on_server"),
        "messages": (
            "ConcedeMessage",
            "HACK_TO_TEE",
            "Point",
            "SPIN",
            "SettingMessage",
            "ShotMessage",
            "StateMessage",
        ),
        "time_manager": ("BUDGETS", "CLOCK_BUDGET", "TimeManager", "stones_to_come"),
    },
)
