//! The report as JUnit XML, for the dashboards of continuous integration.

use pogema_conformance::port::{Cause, PortReport};
use quick_junit::{NonSuccessKind, Property, Report, SerializeError, TestCase, TestCaseStatus, TestSuite};

use super::known::Leftover;
use super::port_table::cause_text;
use super::summary::{
    STOPPED, Standing, Verdict, causes_of, names, score, standing, times, title, verdict, why_unclaimed,
};

/// Returns the report as JUnit XML: a suite for each port, a test case for each rule.
pub fn xml(reports: &[PortReport], leftover: &Leftover) -> Result<String, SerializeError> {
    let mut junit = Report::new("pogema conform");
    for (report, name) in reports.iter().zip(names(reports)) {
        junit.add_test_suite(suite(report, &name));
    }
    if !leftover.stopped.is_empty() {
        junit.add_test_suite(stopped(leftover));
    }
    junit.to_string()
}

fn suite(report: &PortReport, name: &str) -> TestSuite {
    let mut suite = TestSuite::new(name);
    suite.add_property(Property::new("port", title(report)));
    suite.add_property(Property::new("verdict", verdict(report)));
    for rule in report.rules.keys() {
        let causes: Vec<&Cause> = causes_of(report, rule).collect();
        let standing = standing(report, rule);
        let mut case = TestCase::new(rule.as_str(), status(report, rule, standing, &causes));
        case.set_classname(name);
        if standing == Standing::Known {
            case.set_system_out(causes_text(&causes));
        }
        suite.add_test_case(case);
    }
    let score = score(report);
    let mut add_error = |title: &str, ty: &str, message: String| {
        let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
        status.set_type(ty).set_message(message);
        let mut case = TestCase::new(title, status);
        case.set_classname(name);
        suite.add_test_case(case);
    };
    // The run fails for these reasons even if no rule is broken, or all faults are known.
    if score.is_cut_short {
        add_error("(not run)", "misbehaviour", format!("cases not run: {}", report.num_not_run));
    }
    if score.is_interrupted {
        let message = format!("interrupted; cases not reached: {}", report.num_interrupted);
        add_error("(interrupted)", "interruption", message);
    } else if score.verdict() == Verdict::Unchecked {
        add_error("(nothing checked)", "nothing checked", verdict(report));
    }
    suite
}

fn status(report: &PortReport, rule: &str, standing: Standing, causes: &[&Cause]) -> TestCaseStatus {
    let not_passed = |kind, ty: &str| {
        let mut status = TestCaseStatus::non_success(kind);
        let new: Vec<&Cause> = causes.iter().copied().filter(|cause| cause.known.is_none()).collect();
        status.set_type(ty).set_message(in_one_line(&new)).set_description(causes_text(causes));
        status
    };
    let mut skipped = TestCaseStatus::skipped();
    match standing {
        Standing::Passed | Standing::Blank => TestCaseStatus::success(),
        Standing::Failed => not_passed(NonSuccessKind::Failure, "divergence"),
        Standing::Error => not_passed(NonSuccessKind::Error, "misbehaviour"),
        // Skipped, not passed: the rule does not hold. Dashboards count skipped tests and show their messages, but they
        // do not show the output of passed tests.
        Standing::Known => {
            let reasons: Vec<&str> = causes.iter().filter_map(|cause| cause.known.as_deref()).collect();
            skipped.set_type("known").set_message(format!("known {}", reasons.join("; known ")));
            skipped
        }
        Standing::NotClaimed => {
            skipped.set_type("not claimed").set_message(why_unclaimed(report, rule));
            skipped
        }
    }
}

fn in_one_line(causes: &[&Cause]) -> String {
    let line = |cause: &&Cause| match &cause.rule {
        Some(rule) => format!("{rule}: {} differs, {}", cause.what, times(cause)),
        None => format!("{}, {}", cause.what, times(cause)),
    };
    causes.iter().map(line).collect::<Vec<_>>().join("; ")
}

fn causes_text(causes: &[&Cause]) -> String {
    causes.iter().map(|cause| cause_text(cause)).collect::<Vec<_>>().join("\n")
}

/// Returns a suite with the known deviations that stopped occurring: they fail the run, so dashboards must show them.
fn stopped(leftover: &Leftover) -> TestSuite {
    let mut suite = TestSuite::new("known deviations");
    for deviation in &leftover.stopped {
        let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
        status.set_type("stopped").set_message(STOPPED);
        let mut case = TestCase::new(deviation.as_str(), status);
        case.set_classname("known deviations");
        suite.add_test_case(case);
    }
    suite
}
