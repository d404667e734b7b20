// Checks an implementation against the test vectors in the working folder. PORT is a source file that defines
// `json answer(const json& question)`; its `main` is not used. Exits with 1 if an answer is wrong or no vector was
// checked. Needs nlohmann/json.    g++ -O2 -std=c++17 -DPORT='"../ports/template.cpp"' check.cpp -o check && ./check

#define main main_of_port
#include PORT
#undef main
#include <bitset>
#include <cmath>
#include <fstream>

const vector<const char*> OPTIONAL = {"on_goal", "occupied", "padded", "derived", "foretold", "actions_after"};

bool has(const json& list, const json& word) { return std::find(list.begin(), list.end(), word) != list.end(); }

// Returns whether a port claims all that a vector needs. Observation types matter only to the profile `observations`.
bool can_play(const json& claims, const json& needs) {
    const json defaults = {{"occupancy", {"as_released"}}, {"reward", {"own"}}, {"noise", false}};
    for (const auto& [key, need] : needs.items()) {
        if (key == "observation" && !has(claims["profiles"], "observations")) continue;
        const json claim = claims.value(key, defaults.value(key, json()));
        const auto is_claimed = [&](const json& word) { return has(claim, word); };
        if (need.is_array() ? !std::all_of(need.begin(), need.end(), is_claimed)
                            : !claim.is_null() && claim < need) return false;
    }
    return true;
}

// Returns the part of an expected answer that a port with these claims gives.
json compared(const json& claims, json answer) {
    answer.erase("error");
    for (const char* key : {"observations", "metrics"}) if (!has(claims["profiles"], key)) answer.erase(key);
    for (const char* key : OPTIONAL) if (!has(claims.value("tells", json::array()), key)) answer.erase(key);
    const json metrics = answer.value("metrics", json()), claimed = claims.value("metrics", json::array());
    if (metrics.is_object()) answer.erase("metrics");
    for (const auto& [key, value] : metrics.items()) if (has(claimed, key)) answer["metrics"][key] = value;
    return answer;
}

// Returns the values of a window, given as hexadecimal digits or as nested lists, as `0` and `1`.
string bits_of(const json& window) {
    string bits;
    if (window.is_string()) {
        for (const unsigned char digit : window.get<string>())
            bits += std::isxdigit(digit) ? std::bitset<4>(std::stoul(string(1, digit), nullptr, 16)).to_string() : "?";
    } else if (window.is_array()) {
        for (const json& value : window) bits += bits_of(value);
    } else {
        bits = window == 0 || window == false ? "0" : window == 1 || window == true ? "1" : "?";
    }
    return bits;
}

// Compares an expected value with that of an answer.
bool is_same(const string& key, const json& expected, const json& got) {
    if (expected.is_number_integer() && !got.is_number_integer()) return false;
    if (expected.is_number() && got.is_number())
        return std::abs(double(expected) - double(got)) <= 1e-9 * std::max(1.0, std::abs(double(expected)));
    if (!expected.is_structured()) return expected == got;
    if (expected.type() != got.type() || (expected.is_array() && expected.size() != got.size())) return false;
    const bool has_windows = key == "observations" || key == "obstacles" || key == "agents";
    for (const auto& [name, value] : expected.items()) {
        const json other = expected.is_array() ? got[std::stoul(name)] : got.value(name, json());
        string bits = expected.is_array() && has_windows ? bits_of(other) : "";
        bits.append((8 - bits.size() % 8) % 8, '0');
        if (bits.empty() ? !is_same(name, value, other) : bits != bits_of(value)) return false;
    }
    return true;
}

// Plays a vector. Returns the first wrong answer; empty if there is none.
string first_difference(const json& claims, const json& exchanges) {
    for (const json& exchange : exchanges) {
        const json got = answer(exchange["question"]), &expected = exchange["answer"];
        if (got.contains("error") != expected.contains("error")) return got.dump() + ", expected " + expected.dump();
        const json kept = compared(claims, expected);
        for (const auto& [key, value] : kept.items()) {
            const json other = got.value(key, json());
            if (!is_same(key, value, other)) return key + " " + other.dump() + ", expected " + value.dump();
        }
    }
    return "";
}

int main() {
    const auto read = [](const string& path) { return json::parse(std::ifstream(path)); };
    const json manifest = read("manifest.json"), claims = answer({{"type", "hello"}, {"protocol", "pogema-conform/1"}});
    size_t passed = 0, failed = 0;
    for (const json& file : manifest["files"]) {
        const json rule = read(file["path"]);
        for (const json& vector : rule["vectors"]) {
            if (vector.contains("pogema") || !can_play(claims, vector["needs"])) continue;
            const string wrong = first_difference(claims, vector["exchanges"]);
            ++(wrong.empty() ? passed : failed);
            if (!wrong.empty()) std::cout << file["rule"] << ": " << vector["name"] << ": " << wrong << "\n";
        }
    }
    std::cout << passed << " passed, " << failed << " failed" << std::endl;
    return failed || !passed ? 1 : 0;
}
