"""Players, the games they play, and the results of the games.

- `players`: players that look ahead, without learning
- `search`: the player that searches, with its learned value of positions
- `league`: generations of a player that learn by playing each other
- `trained_player`: the player from a model's file or a name
- `potentials`: values of positions, for intermediate rewards
- `offline_data`: ends as a dataset for offline learning
- `match`: a game between two players; `tournament`: many games, with ratings
- `record`: a game as JSON lines; `scoreboard`: its line score; `replay`: its film or page
"""

from curling_env.infrastructure.lazy_names import lazy_names

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "board.advice": ("best_calls",),
        "board.kept_game": ("GameTable", "KeptGame", "kept_throws"),
        "board.recorded": ("rules_in", "state_before"),
        "board.set_up": ("LaidStone", "Position", "set_up"),
        "league.fit": ("Lesson", "fit_value_network"),
        "league.run": ("ends_from", "run_league"),
        "league.self_play": ("PlayedEnds", "end_simulator"),
        "league.settings": ("LeagueSettings", "league_settings"),
        "learned.network": ("IMPOSSIBLE", "ShotNetwork"),
        "learned.player": ("LearnedPlayer",),
        "learned.values": ("ShotValues",),
        "learned.views": ("views_of",),
        "match": ("Match", "play_game"),
        "offline_data": ("DATASET", "RECORDED", "record_ends"),
        "players.greedy": ("GreedyPlayer",),
        "record": ("lines_of", "read_record", "write_record"),
        "record_schema": ("check_lines",),
        "replay.film": ("deliveries_of", "write_film"),
        "replay.page": ("page_of", "write_page"),
        "scoreboard": ("outcome",),
        "search": ("CallingStyle", "SearchPlayer", "throws_before"),
        "search.aiming_table": ("AimingTable",),
        "search.evaluator": ("PositionEvaluator",),
        "search.networks": ("NETWORKS", "network_for"),
        "search.positions": (
            "EndSimulator",
            "MAX_POINTS",
            "SCORES",
            "SLOTS",
            "points_of",
            "position_of",
        ),
        "search.tuning": ("BUDGET",),
        "search.value_network": ("ValueNetwork", "load_network", "skill_feature"),
        "search.win_probability": ("WinProbability",),
        "tournament": ("play_tournament", "ratings", "wilson"),
        "trained_player": ("player_from",),
    },
)
