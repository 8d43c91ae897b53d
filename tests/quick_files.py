"""What `python -m pytest -m quick` runs: these files; behind some, `only` or `but` some tests."""

QUICK = {
    "test_quick.py": "",
    "test_release.py": "",
    "test_workflows.py": "",
    "agents/test_observer.py": "",
    "agents/test_policy_directory.py": (
        "but test_a_policy_with_spoilt_bytes_is_refused_in_one_line_or_is_the_same"
    ),
    "agents/test_route_policy.py": "only test_the_networks_of_the_file_are_those_that_are_compiled",
    "autopilot/test_guidance.py": "",
    "autopilot/test_return_mode.py": "",
    "autopilot/test_safety_filter.py": "",
    "planning/test_legs_flown.py": (
        "only test_waypoints_in_a_row_are_one_leg "
        "test_corners_cost_what_the_leg_model_loses_in_them_and_straight_on_costs_nothing"
    ),
    "baselines/test_simple_planners.py": "",
    "baselines/test_tour.py": (
        "but test_a_uas_slower_than_thought_hands_over_what_its_battery_does_not_last_for"
    ),
    "bound/test_prices_and_turns.py": (
        "only test_the_program_is_a_close_bound_of_the_cheapest_routes "
        "test_a_cut_forces_further_routes test_steps_cost_a_step"
    ),
    "cli/test_mistakes.py": (
        "but test_the_installed_command_answers_like_this_process "
        "test_a_path_that_no_file_can_have_is_named"
    ),
    "clients/test_loops.py": "",
    "compiled/test_cache.py": "only test_every_value_that_a_kernel_names_makes_another_kernel",
    "compiled/test_memory.py": "",
    "conformance/test_gymnasium.py": (
        "but test_stable_baselines_finds_nothing_wrong test_gymnasium_finds_nothing_wrong"
    ),
    "features/test_disturbances_in_the_world.py": "",
    "docs/test_rules.py": "",
    "docs/test_tables.py": "",
    "draw/test_labels.py": "",
    "env/test_actions.py": (
        "but test_whatever_is_given_is_flown_or_refused_and_nothing_becomes_nan"
    ),
    "env/test_cuda_missions.py": "only test_what_does_not_run_on_a_gpu_is_refused_in_one_line",
    "env/test_batch.py": (
        "only test_a_pool_holds_every_arena_as_it_is_built "
        "test_an_action_that_is_refused_changes_nothing"
    ),
    "env/test_missions.py": (
        "only test_a_seed_repeats_the_mission_and_its_flight_in_a_fresh_environment_too "
        "test_spaces_stay_and_smaller_fleets_leave_agents_out "
        "test_all_interfaces_fly_the_same_missions"
    ),
    "env/test_observation.py": "",
    "env/test_planner_actions.py": (
        "only test_a_planner_flies_waypoint_actions_as_it_flies_by_itself_to_the_bit "
        "test_what_a_kind_cannot_express_is_refused_with_the_reason"
    ),
    "env/test_parallel_env.py": "",
    "env/test_rewards.py": "",
    "env/test_vector_env.py": "only test_a_tile_is_the_picture_of_its_mission",
    "env/test_versions.py": "but test_what_python_alone_flies_is_the_same",
    "files/test_strict_toml.py": "but test_whatever_is_given_the_answer_is_a_car_or_one_line",
    "flight/test_directory.py": ("but test_every_finite_number_survives_the_way_through_the_files"),
    "flight/test_metrics.py": "",
    "flight/test_registry.py": "",
    "flight/test_rollout.py": "",
    "geometry/test_polytope.py": "but test_the_hull_agrees_with_delaunay_on_random_points",
    "geometry/test_round_shapes.py": "",
    "geometry/test_segments.py": "",
    "leaderboard/test_scores.py": "but test_accomplished_lpv_flights_have_a_bound",
    "milp_mpc/test_golden_lp.py": "",
    "milp_mpc/test_golden_reductions.py": "",
    "milp_mpc/test_milp_builder.py": "",
    "milp_mpc/test_operation_modes.py": "",
    "milp_mpc/test_paper_numbers.py": "",
    "milp_mpc/test_plan_verification.py": "",
    "milp_mpc/test_solvers.py": (
        "only test_every_solver_finds_the_same_optimum "
        "test_an_unknown_solver_is_refused_with_the_names_there_are"
    ),
    "mission/test_blocked.py": "",
    "routing/test_legs.py": "",
    "missions/test_independent_check.py": "only test_it_agrees_on_a_mission_that_ends_well",
    "operations/test_export.py": (
        "only test_every_corner_of_a_waypoint_file_is_where_it_was_planned"
    ),
    "operations/test_frame.py": "",
    "operations/test_lateness.py": "",
    "operations/test_layout.py": "but test_what_is_not_seen_around_a_forbidden_zone_is_counted",
    "operations/test_leg_model.py": "",
    "operations/test_stream.py": "only test_nothing_arms_unless_somebody_agrees",
    "operations/test_layers.py": "",
    "operations/test_operations_tables.py": "",
    "operations/test_logs.py": (
        "only test_telemetry_holds_places_attitude_and_charge "
        "test_a_data_flash_log_holds_places_attitude_and_charge"
    ),
    "routing/test_order_search.py": "but test_the_search_finds_the_optimum_of_all_orders",
    "paper/test_battery_figure.py": "",
    "planning/test_around.py": "",
    "planning/test_following.py": "",
    "planning/test_backup_courses.py": "",
    "planning/test_reserves.py": "",
    "reproduction/test_comparison.py": "",
    "reproduction/test_told_events.py": "",
    "plugins/test_installed.py": "",
    "replay/test_replay_page.py": "",
    "replay/test_viewer_bundle.py": "",
    "scenario/test_event_tables.py": "",
    "scenario/test_families.py": "only test_every_centre_has_a_free_way_up",
    "runner/test_store.py": "",
    "scenario/test_payload.py": "",
    "scenario/test_scenario_checks.py": "",
    "scenario/test_scenario_load.py": "",
    "scenario/test_scenario_model.py": "",
    "simulation/test_step_against_oracle.py": (
        "but test_random_missions_are_those_of_the_oracle "
        "test_the_random_missions_meet_every_kind_of_contact_and_most_limits"
    ),
    "tasks/test_score.py": "",
    "trajectory/test_trajectory_planner.py": (
        "only test_it_accomplishes_a_town_without_violation_or_breach "
        "test_the_same_seed_flies_the_same_mission"
    ),
    "vehicle/test_discrete_model.py": "",
    "vehicle/test_lpv_step.py": "",
    "vehicle/test_model_corners.py": "",
    "vehicle/test_vehicle_params.py": "",
    "world/test_asked_again.py": (
        "only test_it_is_asked_for_again_so_long_after_it_was_covered_and_comes_last "
        "test_history_and_world_agree_on_every_visit"
    ),
    "world/test_commands.py": "",
    "world/test_contacts.py": "",
    "world/test_coverage_and_landing.py": "",
    "world/test_what_waypoints_ask.py": "",
}


def is_quick(file, test):
    """Whether a test, by its file below `tests/` and its name, is among the quick ones."""
    if file not in QUICK:
        return False
    word, *names = QUICK[file].split() or ["but"]
    return (test in names) == (word == "only")
