//! The variable `POGEMA_SIMD` chooses the path of networks.

use std::process::Command;

use pogema_core::SimdPath;
use pogema_policies::Network;

use crate::learned::descent;

/// If this environment variable is set, the test below is a child process and only prints its SIMD path.
const IS_CHILD: &str = "POGEMA_POLICIES_TEST_CHILD";

#[test]
fn the_variable_chooses_the_path_of_a_network() {
    if std::env::var_os(IS_CHILD).is_some() {
        let path = Network::read(descent()).map(|network| network.simd_path().unwrap());
        println!("<{}>", path.map_or_else(|error| error.to_string(), |path| path.to_string()));
        return;
    }
    assert_eq!(child(None), SimdPath::best().to_string());
    for path in SimdPath::available() {
        assert_eq!(child(Some(&path.to_string())), path.to_string());
    }
    let expected = "`POGEMA_SIMD` is `sse`, expected `scalar`, `avx2` or `avx512`";
    assert_eq!(child(Some("sse")), expected);
}

/// Returns the path or error that a child process prints with this value of the variable.
fn child(variable: Option<&str>) -> String {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "simd_variable::the_variable_chooses_the_path_of_a_network", "--nocapture"]);
    command.env(IS_CHILD, "1").env_remove(SimdPath::VARIABLE);
    command.envs(variable.map(|value| (SimdPath::VARIABLE, value)));
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let (_, answer) = text.split_once('<').unwrap();
    answer.split_once('>').unwrap().0.to_owned()
}
