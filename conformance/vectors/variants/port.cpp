// A port that tests the checker, selected by VARIANT. `core`, `capitals`, `letters` and `metrics` change the answers of
// the template; `seeds` answers each question with an error that gives its seed. `run` explains them.
// The port is compiled together with its checker.

#define answer template_answer
#define main main_of_template
#include "../../ports/template.cpp"
#undef main
#undef answer

#include <cstdlib>

const string VARIANT = std::getenv("VARIANT");

const json SEEDING = {
    {"profiles", {"core", "seeding"}}, {"collision", {"priority"}}, {"on_goal", {"finish"}}, {"observation", {"default"}}};

json answer(const json& question) {
    if (VARIANT == "seeds") {
        const json seed = question.value("config", json::object()).value("seed", json());
        return question["type"] == "hello" ? SEEDING : json{{"error", "seed " + seed.dump()}};
    }
    json given = template_answer(question);
    if (question["type"] == "hello" && VARIANT == "core") {
        given["profiles"] = {"core"};
        given.erase("observation");
    } else if (question["type"] == "hello") {
        given["profiles"].push_back("metrics");
        given["metrics"] = VARIANT == "metrics" ? json{"ISR"} : json::array();
    }
    if (VARIANT == "metrics" && given.contains("rewards")) given["metrics"] = {{"ISR", 0.5}};
    if ((VARIANT == "capitals" || VARIANT == "letters") && given.contains("observations")) {
        for (json& window : given["observations"]) {
            string digits = window;
            std::transform(digits.begin(), digits.end(), digits.begin(), ::toupper);
            if (VARIANT == "letters") digits[0] = 'z';
            window = digits;
        }
    }
    return given;
}

// The port is this file, so the checker includes nothing new.
#undef PORT
#define PORT <string>
#include "../check.cpp"
