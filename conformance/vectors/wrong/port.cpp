// A port that reports metrics in every step, not only at the end of an episode, together with its checker.

#define answer template_answer
#define main main_of_template
#include "../../ports/template.cpp"
#undef main
#undef answer

json answer(const json& question) {
    json given = template_answer(question);
    if (question["type"] == "hello") {
        given["profiles"].push_back("metrics");
        given["metrics"] = {"ISR"};
    } else if (given.contains("rewards")) {
        given["metrics"] = {{"ISR", 0.5}};
    }
    return given;
}

// The port is this file, so the checker includes nothing new.
#undef PORT
#define PORT <string>
#include "../check.cpp"
