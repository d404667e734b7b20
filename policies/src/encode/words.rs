//! The windows and the scalars that an encoder can write, by name.

use pogema_core::words;

words! {
    /// One window of each agent.
    pub enum Channel {
        /// 1 for an obstacle, 0 for a free cell; beyond the wall as in POGEMA's observations.
        Obstacles = "obstacles",
        /// 1 for a cell that the occupancy grid marks, else 0. The agent's own cell is treated like any other.
        Agents = "agents",
        /// 1 for the cell of each active agent, the agent itself included, even if the occupancy grid does not mark it;
        /// else 0.
        AllAgents = "all_agents",
        /// 1 for the goal, moved to the nearest cell of the window if it lies outside; else 0.
        Goal = "goal",
        /// Steps by which a cell is nearer to the goal than the agent's cell, divided by `2 * radius`, limited to -1 to
        /// 1.
        ///
        /// The value is `(own - cost) / (2 * radius)` before the limit. Costs are steps to the goal without other
        /// agents, and `own` is the cost of the agent's cell. Obstacles and cells without a path have -1. Without a
        /// path from the agent's cell, all cells have -1.
        CostToGo = "cost_to_go",
        /// Costs to go, scaled from 0 (obstacle) to 1 (nearest cell), as MATS-LP's network `cost-tracer` reads them.
        ///
        /// Cells without a path count as 4 steps farther than the farthest cell of the window. With `x` as the cost
        /// minus the smallest cost, the value is `(max x - x) / max x`. The centre is replaced by
        /// `-min(1, (cost - best + 1) / 64)`, where `best` is the smallest cost so far for this goal. Without a path
        /// from the agent's cell, the window is 0 and its centre -1.
        ///
        /// Source: MATS-LP, `mcts_cpp`
        CostTracer = "cost_tracer",
        /// 1 for the cells of a shortest path to the goal, the agent's cell included, up to the path's first cell
        /// outside the window; else 0.
        ///
        /// At each cell, the path takes the first action of up, down, left, right that leads nearer to the goal.
        Path = "path",
        /// -1 for an obstacle, 1 for the cells of Follower's path, else 0.
        ///
        /// The path is that of Follower's planner, which searches anew in every state. It is drawn from the agent's
        /// cell up to its first cell outside the window (version `cpp` of `follower`) or outside `sight` (version
        /// `python`).
        ///
        /// Source: Follower, `follower_cpp/follower.cpp`
        FollowerPath = "follower_path",
        /// 1 for a cell within `sight` that the occupancy grid marks, else 0. The agent's own cell is treated like any
        /// other.
        SeenAgents = "seen_agents",
        /// 1 for an obstacle that the agent has seen in this episode; else 0.
        ///
        /// The agent sees the cells within `sight` in every state that is encoded.
        ///
        /// Source: when-to-switch, `learning/grid_memory.py`
        SeenObstacles = "seen_obstacles",
    }
}

words! {
    /// Scalars of an agent, which a network reads beside the windows. Each kind has two values.
    pub enum Scalars {
        /// The cell relative to the start: rows and columns, each `x / max(|x|, 64)`.
        Position = "position",
        /// The goal relative to the start: rows and columns, each `x / max(|x|, 64)`.
        GoalPosition = "goal_position",
        /// The goal relative to the cell: rows and columns, each `x / max(|x|, 64)`.
        GoalOffset = "goal_offset",
        /// The unit vector from the cell to the goal: rows and columns; 0 on the goal.
        GoalDirection = "goal_direction",
    }
}

impl Scalars {
    /// The number of values of each kind.
    pub const LEN: usize = 2;
}
