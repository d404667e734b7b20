//! Plans as text: a plan reads back as it was written.

use pogema_core::{Cell, Map};
use pogema_planners::{Outcome, Plan, PlanText, Problem, write_plan, write_result};

fn cell(row: u16, col: u16) -> Cell {
    Cell { row, col }
}

fn plan() -> Plan {
    Plan::new(vec![vec![cell(0, 0), cell(2, 1)], vec![cell(0, 1), cell(2, 1)], vec![cell(1, 1), cell(2, 0)]])
        .unwrap()
}

#[test]
fn a_plan_reads_back_as_it_was_written() {
    assert_eq!(write_plan(&plan()), "0: (0,0) (2,1)\n1: (0,1) (2,1)\n2: (1,1) (2,0)\n");
    assert_eq!(PlanText::read(&write_plan(&plan())).unwrap().plan, plan());
    let loose = "# two agents\n\n(0, 0), (2, 1),\n  (0,1)(2,1)\n2 : ( 1 , 1 ) , (2,0)";
    assert_eq!(PlanText::read(loose).unwrap().plan, plan());
}

#[test]
fn a_result_reads_back_as_it_was_written() {
    let map = Map::from_rows(&["..", "..", ".."]).unwrap();
    let problem = Problem::new(&map, &plan().cells()[0], &plan().cells()[2]).unwrap();
    let outcome = Outcome::Solved { plan: plan(), lower_bound: 3 };
    let text = write_result("small.map", "none", &problem, &outcome);
    assert_eq!(
        text,
        "agents=2\nmap_file=small.map\nsolver=none\nsolved=1\nsoc=4\nsoc_lb=3\nmakespan=2\n\
         starts=(0,0),(1,2),\ngoals=(1,1),(0,2),\nsolution=\n0:(0,0),(1,2),\n1:(1,0),(1,2),\n2:(1,1),(0,2),\n"
    );
    let read = PlanText::read(&text).unwrap();
    assert_eq!((read.plan, read.map_file.as_deref()), (plan(), Some("small.map")));
    assert_eq!((read.starts, read.goals), (Some(plan().cells()[0].clone()), Some(plan().cells()[2].clone())));
    let none = write_result("small.map", "none", &problem, &Outcome::TimedOut { best: None, lower_bound: 0 });
    assert!(none.contains("solved=0\n"));
    assert_eq!(
        PlanText::read(&none).unwrap_err().to_string(),
        "the result contains no solution, expected steps after the line `solution=`"
    );
}

#[test]
fn invalid_plans_are_reported_with_line_numbers() {
    for (text, expected) in [
        ("", "the text contains no step, expected a line such as `0: (3,4)`"),
        ("# a comment\n", "the text contains no step, expected a line such as `0: (3,4)`"),
        ("0: (0,0)\n\n2: (0,1)", "line 3: found `2`, expected step 1"),
        ("(0,0) (1,1)\n(0,0)", "line 2: found 1 cell, expected 2, as in the first step"),
        ("(0,0) 7", "line 1: found `7`, expected a cell such as `(3,4)`"),
        ("(0,0", "line 1: found `(0,0`, expected a cell such as `(3,4)`"),
        ("(0;0)", "line 1: found `0;0`, expected two whole numbers from 0 to 65535, such as `3,4`"),
        ("(0,-1)", "line 1: found `0,-1`, expected two whole numbers from 0 to 65535, such as `3,4`"),
        ("(0,65536)", "line 1: found `0,65536`, expected two whole numbers from 0 to 65535, such as `3,4`"),
        ("agents\nsolution=\n0:(0,0)", "line 1: found `agents`, expected a field such as `agents=2`"),
        (
            "starts=(0,a),\nsolution=\n0:(0,0)",
            "line 1: found `0,a`, expected two whole numbers from 0 to 65535, such as `3,4`",
        ),
    ] {
        assert_eq!(PlanText::read(text).unwrap_err().to_string(), expected, "{text}");
    }
}
