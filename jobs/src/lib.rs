//! Workers, job graph, parallel-for and spans: the only clock of overfly.
