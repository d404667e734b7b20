// A complete port to copy: a small environment with all three collision systems, and the adapter that connects it to
// the checks. Replace `Environment` with your own environment, and list its abilities in `CLAIMS`. docs/PORTING.md
// explains the questions and answers.
//
// Needs nlohmann/json (Debian: nlohmann-json3-dev):   g++ -O2 -std=c++17 template.cpp -o template

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

using nlohmann::json;
using std::size_t;
using std::string;
using std::vector;

// ------------------------------------ The environment. Replace it with yours. --------------------------------------

struct Cell {
    int row, col;
    bool operator==(const Cell& other) const { return row == other.row && col == other.col; }
    bool operator<(const Cell& other) const { return row != other.row ? row < other.row : col < other.col; }
};

void from_json(const json& pair, Cell& cell) { cell = {pair.at(0), pair.at(1)}; }
void to_json(json& pair, const Cell& cell) { pair = {cell.row, cell.col}; }

constexpr Cell MOVES[] = {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}};  // stay, up, down, left, right

// A map with its border. The border is as wide as the radius, so no window extends beyond it.
using Grid = vector<string>;

struct Results {
    vector<double> rewards;
    vector<bool> terminated, truncated;
    vector<int> actions;  // as carried out
};

class Environment {
public:
    vector<Cell> cells, goals;
    vector<bool> active;

    explicit Environment(const json& instance) {
        const json& config = instance.at("config");
        collision = config.at("collision");
        on_goal = config.at("on_goal");
        radius = config.at("radius");
        max_steps = config.at("max_steps");
        starts = instance.at("starts").get<vector<Cell>>();
        goal_lists = instance.at("goals").get<vector<vector<Cell>>>();
        if (config.at("reward") != "own" || config.at("occupancy") != "as_released" ||
            instance.value("outside", json("free")) != "free") {
            throw std::invalid_argument("the instance uses rules that this port does not claim");
        }
        const vector<string> map = instance.at("map");
        const int height = map.size(), width = map.front().size();
        obstacles = Grid(height + 2 * radius, string(width + 2 * radius, '0'));
        // The border is free except for the wall, which is one cell wide.
        for (int row = -1; row <= height; ++row) {
            for (int col = -1; col <= width; ++col) {
                const bool is_inside = row >= 0 && row < height && col >= 0 && col < width;
                at(obstacles, {row, col}) = is_inside && map[row][col] != '#' ? '0' : '1';
            }
        }
    }

    // Begins a new episode. All agents are active, even an agent that starts on its goal.
    void reset() {
        steps = 0;
        cells = starts;
        goals.clear();
        for (const auto& goal_list : goal_lists) goals.push_back(goal_list.front());
        reached.assign(cells.size(), 0);
        active.assign(cells.size(), true);
        marks = Grid(obstacles.size(), string(obstacles.front().size(), '0'));
        for (const Cell& cell : cells) at(marks, cell) = '1';
    }

    Results step(const vector<int>& actions) {
        const auto is_wrong = [](int action) { return action < 0 || action > 4; };
        if (actions.size() != cells.size() || std::any_of(actions.begin(), actions.end(), is_wrong)) {
            throw std::invalid_argument("expected an action from 0 to 4 for each agent");  // the state is unchanged
        }
        Results results;
        results.actions = actions;
        if (collision == "priority") move_in_turn(actions);
        else if (collision == "block_both") move_apart(actions);
        else move_softly(results.actions);
        ++steps;
        arrive(results);
        results.truncated.assign(cells.size(), steps >= max_steps);
        return results;
    }

    // Returns the observation of an agent, also of a finished one, row by row as `0` and `1`: obstacles, agents (itself
    // included), and its goal.
    string observe(size_t agent) const {
        const Cell cell = cells[agent], goal = goals[agent];
        const int side = 2 * radius + 1;
        string bits;
        for (const Grid* grid : {&obstacles, &marks}) {
            for (int row = cell.row; row < cell.row + side; ++row) bits.append((*grid)[row], cell.col, side);
        }
        // A goal outside the window is drawn on its edge: each axis is clamped separately.
        const int down = std::clamp(goal.row - cell.row, -radius, radius);
        const int right = std::clamp(goal.col - cell.col, -radius, radius);
        string window(side * side, '0');
        window[(radius + down) * side + radius + right] = '1';
        return bits + window;
    }

private:
    string collision, on_goal;
    int radius = 0, max_steps = 0, steps = 0;
    vector<Cell> starts;
    vector<vector<Cell>> goal_lists;
    vector<size_t> reached;  // for each agent, the number of goals it has reached
    Grid obstacles, marks;

    char& at(Grid& grid, Cell cell) const { return grid[cell.row + radius][cell.col + radius]; }

    bool is_free(Cell cell) { return at(obstacles, cell) == '0' && at(marks, cell) == '0'; }

    Cell there(size_t agent, int action) const {
        return {cells[agent].row + MOVES[action].row, cells[agent].col + MOVES[action].col};
    }

    void go(size_t agent, Cell to) {
        at(marks, cells[agent]) = '0';
        at(marks, to) = '1';
        cells[agent] = to;
    }

    // `priority`: agents move one after the other, and each move takes effect before the next.
    void move_in_turn(const vector<int>& actions) {
        for (size_t agent = 0; agent < cells.size(); ++agent) {
            const Cell to = there(agent, actions[agent]);
            if (active[agent] && is_free(to)) go(agent, to);
        }
    }

    // `block_both`: an agent moves if its target is free before the step and no other agent has the same target.
    void move_apart(const vector<int>& actions) {
        std::map<Cell, vector<size_t>> claims;
        for (size_t agent = 0; agent < cells.size(); ++agent) {
            const Cell to = there(agent, actions[agent]);
            if (active[agent] && is_free(to)) claims[to].push_back(agent);
        }
        for (const auto& [to, claimants] : claims) {
            if (claimants.size() == 1) go(claimants.front(), to);
        }
    }

    // `soft`: agents in conflict stay, until no conflict is left. Their actions become 0, which POGEMA writes into the
    // caller's list.
    void move_softly(vector<int>& actions) {
        std::map<Cell, size_t> agent_on;
        for (size_t agent = 0; agent < cells.size(); ++agent) {
            if (active[agent]) agent_on[cells[agent]] = agent;
        }
        for (bool is_settled = false; !is_settled;) {
            is_settled = true;
            std::map<Cell, size_t> winners;
            for (size_t agent = 0; agent < cells.size(); ++agent) {
                if (!active[agent] || actions[agent] == 0) continue;
                const Cell to = there(agent, actions[agent]);
                const auto ahead = agent_on.find(to);
                // The agent ahead stays, or the two agents would swap.
                const bool is_blocked = ahead != agent_on.end() && (actions[ahead->second] == 0 ||
                    there(ahead->second, actions[ahead->second]) == cells[agent]);
                if (is_blocked || at(obstacles, to) == '1' || !winners.emplace(to, agent).second) {
                    actions[agent] = 0;
                    is_settled = false;
                }
            }
        }
        // Agents move in order of index. An agent that leaves a cell clears the mark of an agent of lower index that
        // has just entered it. For this reason, agents of POGEMA can vanish from the windows.
        for (size_t agent = 0; agent < cells.size(); ++agent) {
            if (active[agent]) go(agent, there(agent, actions[agent]));
        }
    }

    // Computes rewards, `terminated`, and the effects of reached goals. Observations are taken afterwards.
    void arrive(Results& results) {
        bool are_all_there = true;
        for (size_t agent = 0; agent < cells.size(); ++agent) are_all_there &= cells[agent] == goals[agent];
        for (size_t agent = 0; agent < cells.size(); ++agent) {
            const bool is_there = cells[agent] == goals[agent], has_arrived = is_there && active[agent];
            results.rewards.push_back(on_goal == "nothing" ? are_all_there : has_arrived);
            results.terminated.push_back(on_goal == "nothing" ? are_all_there : is_there && on_goal == "finish");
            if (has_arrived && on_goal == "finish") {
                active[agent] = false;
                at(marks, cells[agent]) = '0';
            } else if (has_arrived && on_goal == "restart") {
                goals[agent] = goal_lists[agent][++reached[agent] % goal_lists[agent].size()];
            }
        }
    }
};

// ------------------------------- The adapter: turns questions into calls and results into answers. ----------------

const json CLAIMS = {
    {"protocol", "pogema-conform/1"},
    {"name", "template.cpp"},
    {"version", "1"},
    {"profiles", {"core", "observations"}},
    {"collision", {"priority", "block_both", "soft"}},
    {"on_goal", {"finish", "nothing", "restart"}},
    {"observation", {"default"}},
    {"tells", {"actions_after"}},
};

// Packs bits into hexadecimal digits, eight bits per byte. Nested lists of numbers are also valid, but slower.
string packed(string bits) {
    bits.append((8 - bits.size() % 8) % 8, '0');
    string digits;
    for (size_t start = 0; start < bits.size(); start += 4) {
        digits += "0123456789abcdef"[std::stoi(bits.substr(start, 4), nullptr, 2)];
    }
    return digits;
}

// Executes a `reset` or a `step`. The two answers share most keys.
json play(Environment& environment, const json& question) {
    json reply = json::object();
    if (question.at("type") == "reset") {
        environment.reset();
    } else {
        const Results results = environment.step(question.at("actions"));
        reply = {{"rewards", results.rewards}, {"terminated", results.terminated}};
        reply.update({{"truncated", results.truncated}, {"actions_after", results.actions}});
    }
    reply.update({{"cells", environment.cells}, {"goals", environment.goals}, {"active", environment.active}});
    for (size_t agent = 0; agent < environment.cells.size(); ++agent) {
        reply["observations"].push_back(packed(environment.observe(agent)));
    }
    return reply;
}

// Answers a question. A refusal is also an answer.
json answer(const json& question) {
    static std::unique_ptr<Environment> environment;
    try {
        const string type = question.at("type");
        if (type == "hello") return CLAIMS;
        // A `reset` without an instance resets the current environment.
        if (question.contains("instance")) {
            environment.reset();
            environment = std::make_unique<Environment>(question.at("instance"));
        }
        if (!environment || (type != "reset" && type != "step") || question.contains("config")) {
            throw std::invalid_argument("this port does not support this question, or no instance was sent yet");
        }
        return play(*environment, question);
    } catch (const std::exception& error) {
        return {{"error", error.what()}};
    }
}

// Reads one question per line and writes one answer per line, until `bye`.
int main() {
    for (string line; std::getline(std::cin, line);) {
        const json question = json::parse(line);
        if (question.at("type") == "bye") break;
        std::cout << answer(question).dump() << std::endl;
    }
    return 0;
}
