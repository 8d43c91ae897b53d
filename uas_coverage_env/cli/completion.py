"""What a shell offers to complete arguments with; what is heavy is imported when it asks."""


def scenarios(incomplete: str) -> list[str]:
    """Scenarios by name; of those that are generated, all but the seed."""
    from uas_coverage_env.scenario import scenario_names
    from uas_coverage_env.scenario.families import installed_families

    known = (*scenario_names(), *(f"{family}:" for family in installed_families()))
    return [name for name in known if name.startswith(incomplete)]


def planners(incomplete: str) -> list[str]:
    """Planners by name."""
    from uas_coverage_env.flight import planner_names

    return [name for name in planner_names() if name.startswith(incomplete)]
