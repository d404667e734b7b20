//! Random configs, most of them nearly valid.

use pogema_conformance::{Op, Request, draw_request};
use pogema_maps::FIELDS;
use pogema_numpy::Generator;
use serde_json::{Map as Object, Value, json};

/// The seed of the configs, fixed so that every run draws the same ones.
const SEED: u64 = 14_000;

/// Returns a request with a random config: a playable one, or one with up to three random fields. Up to two fields are
/// then changed, added or removed.
pub fn request(case: u64) -> Request {
    let mut random = RandomValues(Generator::seeded(SEED + case));
    let mut request = draw_request(SEED, case);
    request.ops = vec![Op::Reset(None)];
    request.density = false;
    if random.below(2) == 0 {
        request.register = None;
        request.config = json!({});
        for _field in 0..random.below(4) {
            random.set_near(&mut request.config);
        }
    }
    for _field in 0..random.below(3) {
        random.set_odd(&mut request.config);
    }
    // Without a seed the two implementations would draw different random numbers.
    if request.config.get("seed").is_none_or(Value::is_null) {
        request.config["seed"] = json!(case);
    }
    request
}

struct RandomValues(Generator);

impl RandomValues {
    fn below(&mut self, limit: usize) -> usize {
        self.0.integers(0, limit as i64).unwrap() as usize
    }

    fn pick(&mut self, list: &[Value]) -> Value {
        list[self.below(list.len())].clone()
    }

    fn set_near(&mut self, config: &mut Value) {
        let field = FIELDS[self.below(FIELDS.len())];
        config[field] = self.near(field);
    }

    /// Sets a field to a value that may be wrong, or removes it.
    fn set_odd(&mut self, config: &mut Value) {
        let field = FIELDS[self.below(FIELDS.len())];
        match self.below(8) {
            0 => drop(config.as_object_mut().map(|fields: &mut Object<_, _>| fields.remove(field))),
            1..=3 => config[field] = self.near(field),
            _ => config[field] = self.odd(),
        }
    }

    fn cell(&mut self) -> Value {
        json!([self.below(5), self.below(5)])
    }

    fn cells(&mut self) -> Vec<Value> {
        (0..self.below(4)).map(|_| self.cell()).collect()
    }

    /// Returns a value of the right type, which may still be wrong for the field.
    fn near(&mut self, field: &str) -> Value {
        match field {
            "MOVES" => {
                self.pick(&[json!([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]]), json!([[0, 0], [0, 1]])])
            }
            "FREE" | "OBSTACLE" => self.pick(&[json!(0), json!(1)]),
            "on_target" => self.pick(&["finish", "nothing", "restart", "restart"].map(Value::from)),
            "collision_system" => self.pick(&["priority", "block_both", "soft", "hard"].map(Value::from)),
            "observation_type" => self.pick(&["default", "POMAPF", "MAPF", "mapf"].map(Value::from)),
            "integration" => self.pick(&["SampleFactory", "rllib", "Rllib"].map(Value::from)),
            "empty_outside" | "persistent" | "auto_reset" => self.pick(&[json!(true), json!(false)]),
            "density" => self.pick(&[0.0, 0.3, 0.5, 1.0, 1.5].map(Value::from)),
            "map" => {
                self.pick(&["...", "a.A\n...", "aB.b", "@$.\n!..", "..\n...", "#", "", ".?"].map(Value::from))
            }
            "map_name" => self.pick(&["nowhere", ""].map(Value::from)),
            "agents_xy" | "possible_agents_xy" | "possible_targets_xy" => json!(self.cells()),
            "targets_xy" if self.below(2) == 0 => json!(self.cells()),
            "targets_xy" => (0..self.below(4)).map(|_| json!(self.cells())).collect(),
            "occupancy" => self.pick(&["as_released", "exact", "wrong"].map(Value::from)),
            "reward" => self.pick(&["own", "shared", "wrong"].map(Value::from)),
            "limits" => self.pick(&["as_released", "wrong"].map(Value::from)),
            _ => json!(self.below(7)),
        }
    }

    fn odd(&mut self) -> Value {
        let numbers =
            [json!(0), json!(1), json!(2), json!(-1), json!(0.0), json!(1.0), json!(0.5), json!(2.5)];
        let large =
            [json!(1e300), json!(i64::MAX), json!(i64::MIN), json!(u64::MAX), json!(65_536), json!(9)];
        let words = ["", "0", "1", "-1", "0.5", "1e3", "true", "on", "nan", "inf", ".", "aA", "soft", " 2 "];
        let lists =
            [json!([]), json!([[]]), json!([[[]]]), json!([0]), json!([0, 0]), json!([[0]]), json!([[0, 0]])];
        let cells = [
            json!([[0, 1, 0]]),
            json!([[0, -1]]),
            json!([[0.0, 1]]),
            json!([[true, false]]),
            json!([["0", "0"]]),
            json!([[null, 0]]),
            json!([[0, 0], [0, 0]]),
            json!([[0, 0], [1, 1]]),
            json!([[0, 0], [9, 9]]),
            json!([[0, 0], [0]]),
            json!([[[0, 0]]]),
            json!([[[0, 0], [0, 1]]]),
            json!([[[0, 0], [0, 1]], [[1, 1], [2, 2]]]),
            json!([[[0, 0], [0, 1]], [1, 1]]),
            json!(["..", ".."]),
            json!([[2, 0], [0, 0]]),
        ];
        let others = [Value::Null, json!(true), json!(false), json!({}), json!({ "0": 1 })];
        match self.below(6) {
            0 => self.pick(&numbers),
            1 => self.pick(&large),
            2 => self.pick(&words.map(Value::from)),
            3 => self.pick(&lists),
            4 => self.pick(&cells),
            _ => self.pick(&others),
        }
    }
}
