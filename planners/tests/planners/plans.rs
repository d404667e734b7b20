//! Plans, their validation, and the distances that planners use.

use std::sync::Arc;

use pogema_core::{Action, Cell, Map, Words};
use pogema_planners::{
    Budget, ConflictKind, Distances, Graph, Outcome, Plan, PlannerName, PlannerSettings, Problem,
    UNREACHABLE, validate,
};

use crate::common::cells;

fn cell((row, col): (u16, u16)) -> Cell {
    Cell { row, col }
}

fn plan(steps: &[&[(u16, u16)]]) -> Plan {
    Plan::new(steps.iter().map(|step| cells(step)).collect()).unwrap()
}

fn map() -> Map {
    Map::from_rows(&["...", ".#.", "..."]).unwrap()
}

#[test]
fn agents_may_follow_each_other_in_a_ring() {
    let around = [(0, 0), (0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0)];
    let mut next = around;
    next.rotate_left(1);
    let plan = plan(&[&around, &next]);
    assert_eq!(validate(&map(), &cells(&around), Some(&cells(&next)), &plan), Ok(()));
    assert_eq!((plan.sum_of_costs(), plan.makespan(), plan.num_steps()), (8, 1, 1));
    assert_eq!(plan.actions(0).unwrap()[..3], [Action::Right, Action::Right, Action::Down]);
}

#[test]
fn each_conflict_is_reported_with_its_step_and_agents() {
    let check = |steps: &[&[(u16, u16)]], ends: &[(u16, u16)]| {
        let plan = plan(steps);
        let starts = cells(&[(0, 0), (0, 2)]);
        validate(&map(), &starts, Some(&cells(ends)), &plan)
            .map_err(|conflict| (conflict.kind, conflict.step, conflict.agents.clone(), conflict.to_string()))
    };
    let stay: &[(u16, u16)] = &[(0, 0), (0, 2)];
    assert_eq!(check(&[stay], stay), Ok(()));
    let of = |kind, step, agents: &[usize], text: &str| Err((kind, step, agents.to_vec(), text.to_owned()));
    assert_eq!(
        check(&[&[(0, 0), (1, 2)]], stay),
        of(
            ConflictKind::Start { expected: Cell::new(0, 2) },
            0,
            &[1],
            "agent 1 begins at (1, 2), expected its start (0, 2)"
        )
    );
    assert_eq!(
        check(&[stay, &[(0, 0), (0, 3)]], stay),
        of(ConflictKind::Outside, 1, &[1], "step 1: agent 1 leaves the map at (0, 3)")
    );
    assert_eq!(
        check(&[stay, &[(0, 1), (0, 2)], &[(1, 1), (0, 2)]], stay),
        of(ConflictKind::Obstacle, 2, &[0], "step 2: agent 0 is on an obstacle at (1, 1)")
    );
    assert_eq!(
        check(&[stay, stay, &[(0, 0), (2, 2)]], stay),
        of(
            ConflictKind::Jump { from: Cell::new(0, 2) },
            2,
            &[1],
            "step 2: agent 1 jumps from (0, 2) to (2, 2)"
        )
    );
    assert_eq!(
        check(&[stay, &[(0, 1), (0, 1)]], stay),
        of(ConflictKind::Vertex, 1, &[0, 1], "step 1: agents 0 and 1 are both at (0, 1)")
    );
    assert_eq!(
        check(&[stay, &[(0, 1), (0, 2)], &[(0, 2), (0, 1)]], stay),
        of(ConflictKind::Edge, 2, &[0, 1], "step 2: agents 0 and 1 swap at (0, 1)")
    );
    assert_eq!(
        check(&[stay, &[(1, 0), (0, 2)]], &[(1, 0), (0, 1)]),
        of(
            ConflictKind::Goal { expected: Cell::new(0, 1) },
            1,
            &[1],
            "agent 1 ends at (0, 2), expected its goal (0, 1)"
        )
    );
}

#[test]
fn a_jump_across_the_longest_map_is_reported() {
    // The distance is 65,536, which is 0 in 16 bits.
    let map = Map::new(Map::LONGEST_SIDE, 259, vec![false; Map::LONGEST_SIDE * 259]).unwrap();
    let (start, end) = ((0, 0), (Map::LONGEST_SIDE as u16 - 1, 258));
    let conflict = validate(&map, &cells(&[start]), None, &plan(&[&[start], &[end]])).unwrap_err();
    assert_eq!(conflict.kind, ConflictKind::Jump { from: Cell::new(0, 0) });
}

#[test]
fn a_wrong_number_of_agents_is_reported_first() {
    let stay = plan(&[&[(0, 0), (0, 2)]]);
    let text = |starts: &[(u16, u16)], goals: &[(u16, u16)]| {
        validate(&map(), &cells(starts), Some(&cells(goals)), &stay).unwrap_err().to_string()
    };
    let (one, two, three) = ([(2, 2)], [(2, 2), (0, 2)], [(2, 2), (0, 2), (2, 0)]);
    assert_eq!(text(&three, &three), "the plan has 2 agents, expected 3, the number of starts");
    assert_eq!(text(&one, &two), "the plan has 2 agents, expected 1, the number of starts");
    assert_eq!(text(&two, &three), "the plan has 2 agents, expected 3, the number of goals");
}

#[test]
fn costs_count_the_steps_until_an_agent_stays_at_its_last_cell() {
    let plan = plan(&[&[(0, 0), (2, 0)], &[(0, 1), (2, 0)], &[(0, 0), (2, 1)], &[(0, 0), (2, 1)]]);
    assert_eq!(plan.arrivals(), [2, 2]);
    assert_eq!((plan.sum_of_costs(), plan.makespan(), plan.num_steps()), (4, 2, 3));
    assert_eq!(plan.actions(1).unwrap(), [Action::Left, Action::Right]);
    assert_eq!(plan.actions(9).unwrap(), [Action::Stay, Action::Stay]);
}

#[test]
fn every_step_of_a_plan_has_the_same_number_of_agents() {
    let error = Plan::new(vec![cells(&[(0, 0), (0, 1)]), cells(&[(0, 0)])]).unwrap_err();
    assert_eq!(error.to_string(), "step 1 has 1 cell, expected 2, as at the start");
    assert_eq!(Plan::new(Vec::new()).unwrap_err().to_string(), "instance: the plan has no start");
}

#[test]
fn costs_to_go_are_exact() {
    let map = Map::from_rows(&["..#..", ".##.#", "....."]).unwrap();
    let graph = Arc::new(Graph::new(&map));
    let mut distances = Distances::new(graph.clone(), 0);
    let goal = graph.vertex(cell((0, 4))).unwrap();
    for (place, cost) in [((0, 4), 0), ((0, 3), 1), ((2, 3), 3), ((2, 0), 6), ((0, 1), 9)] {
        let vertex = graph.vertex(cell(place)).unwrap();
        assert_eq!(distances.to(goal)[vertex as usize], cost);
        assert_eq!(distances.to(vertex)[goal as usize], cost);
    }
    assert_eq!([(0, 2), (0, 5), (3, 0)].map(|place| graph.vertex(cell(place))), [None; 3]);
    let apart = Graph::new(&Map::from_rows(&[".#."]).unwrap());
    assert_eq!(Distances::new(Arc::new(apart), 0).to(1)[0], UNREACHABLE);
}

#[test]
fn the_cache_evicts_tables_except_those_in_use() {
    let graph = Arc::new(Graph::new(&Map::new(4, 4, vec![false; 16]).unwrap()));
    let mut distances = Distances::new(graph, 3 * 16 * size_of::<u32>());
    let held = distances.to(0);
    for goal in 1..16 {
        assert_eq!(distances.to(goal)[goal as usize], 0);
        assert!(distances.num_tables() <= 3);
    }
    assert!(Arc::ptr_eq(&held, &distances.to(0)));
}

#[test]
fn impossible_problems_are_reported_with_the_reason() {
    type Case<'a> = (&'a [&'a str], [&'a [(u16, u16)]; 2], &'a str);
    let cases: [Case<'_>; 4] = [
        (&["..", ".."], [&[(0, 0), (0, 0)], &[(0, 1), (1, 1)]], "agents 0 and 1 have the same start (0, 0)"),
        (&["..", ".."], [&[(0, 0), (0, 1)], &[(1, 1), (1, 1)]], "agents 0 and 1 have the same goal (1, 1)"),
        (&[".#."], [&[(0, 0)], &[(0, 2)]], "no path leads agent 0 from (0, 0) to (0, 2)"),
        (
            &["....."],
            [&[(0, 0)], &[(0, 4)]],
            "agent 0 needs 4 steps from (0, 0) to (0, 4), but the step limit is 3",
        ),
    ];
    for name in PlannerName::all() {
        for (rows, [starts, goals], reason) in cases {
            let map = Map::from_rows(rows).unwrap();
            let problem = Problem::new(&map, &cells(starts), &cells(goals)).unwrap().within(3);
            let outcome = name.make(PlannerSettings::default()).plan(&problem, &Budget::default());
            assert_eq!(outcome, Outcome::Impossible { reason: reason.to_owned() }, "{name}");
        }
    }
}

#[test]
fn invalid_problems_are_rejected() {
    let map = Map::from_rows(&[".#", ".."]).unwrap();
    let error = |starts: &[(u16, u16)], goals: &[(u16, u16)]| {
        Problem::new(&map, &cells(starts), &cells(goals)).unwrap_err().to_string()
    };
    assert_eq!(error(&[(0, 0)], &[]), "goals has length 0, expected 1");
    assert_eq!(error(&[(0, 1)], &[(0, 0)]), "instance: agent 0: start (0, 1) is not a free cell of the map");
    assert_eq!(error(&[(0, 0)], &[(0, 2)]), "instance: agent 0: goal (0, 2) is not a free cell of the map");
    assert_eq!(error(&[(0, 0)], &[(9, 9)]), "instance: agent 0: goal (9, 9) is not a free cell of the map");
}
