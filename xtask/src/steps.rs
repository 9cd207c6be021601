//! Steps as data, and the one way of running them.
//!
//! In:    a [`Step`]: name, reason, command.
//! Out:   its output as it comes, the elapsed time, or how it [`Stopped`].
//! Keeps: nothing.
//! Not here: which steps there are (`main`, `set_up` and the other files).

use std::fmt::{self, Display, Formatter};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

/// One command and why it is run.
pub struct Step {
    name: String,
    why: String,
    program: String,
    arguments: Vec<String>,
    variables: Vec<(String, String)>,
}

impl Step {
    /// A command without arguments.
    pub fn new(name: &str, why: &str, program: &str) -> Self {
        let (name, why, program) = (name.into(), why.into(), program.into());
        Self { name, why, program, arguments: Vec::new(), variables: Vec::new() }
    }

    /// The same with more arguments.
    pub fn with(mut self, arguments: &[&str]) -> Self {
        self.arguments.extend(arguments.iter().map(|argument| (*argument).to_owned()));
        self
    }

    /// The same with an environment variable.
    pub fn set(mut self, variable: &str, value: &str) -> Self {
        self.variables.push((variable.into(), value.into()));
        self
    }

    fn command(&self, folder: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments).current_dir(folder);
        command.envs(self.variables.iter().map(|(name, value)| (name, value)));
        command
    }

    fn announce(&self) {
        println!("\n== {}: {}", self.name, self.why);
        let variables = self.variables.iter().map(|(name, value)| format!("{name}={value} "));
        let arguments = self.arguments.join(" ");
        println!("   {}{} {arguments}", variables.collect::<String>(), self.program);
        // The step writes to the same place; this line comes first.
        std::io::stdout().flush().ok();
    }
}

/// A step that did not succeed.
#[derive(Debug)]
pub struct Stopped {
    /// The step's name.
    pub step: String,
    /// What happened.
    pub what: String,
    /// The exit code to pass on; never 0.
    pub code: u8,
}

impl Display for Stopped {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        write!(f, "the step {} {}", self.step, self.what)
    }
}

/// Where cargo builds to.
pub fn target(root: &Path) -> PathBuf {
    root.join(std::env::var_os("CARGO_TARGET_DIR").map_or("target".into(), PathBuf::from))
}

/// Runs a step in `folder` and prints how long it took.
pub fn run(folder: &Path, step: &Step) -> Result<(), Stopped> {
    step.announce();
    let start = now();
    let status = step.command(folder).status();
    conclude(step, start, status)
}

/// Runs a step; where it fails also what it said on its standard error.
pub fn run_heard(folder: &Path, step: &Step) -> Result<(), (Stopped, String)> {
    step.announce();
    let start = now();
    let child = step.command(folder).stderr(Stdio::piped()).spawn();
    let done = child.and_then(std::process::Child::wait_with_output);
    let said = done.as_ref().map(|done| String::from_utf8_lossy(&done.stderr).into_owned());
    let said = said.unwrap_or_default();
    eprint!("{said}");
    conclude(step, start, done.map(|done| done.status)).map_err(|stopped| (stopped, said))
}

/// Runs a step that prints cargo's test results, and prints their sum.
pub fn run_tests(folder: &Path, step: &Step) -> Result<(), Stopped> {
    step.announce();
    let start = now();
    let mut sum = TestSum::default();
    let status = step.command(folder).stdout(Stdio::piped()).spawn().and_then(|mut child| {
        let output = child.stdout.take().expect("the output was asked for above");
        for line in BufReader::new(output).split(b'\n') {
            let line = line?;
            let line = String::from_utf8_lossy(&line);
            sum.add(&line);
            println!("{line}");
        }
        child.wait()
    });
    let TestSum { binaries, passed, failed, ignored } = sum;
    println!("\n{passed} tests passed, {failed} failed, {ignored} ignored in {binaries} binaries.");
    conclude(step, start, status)
}

fn conclude(
    step: &Step,
    start: Instant,
    status: std::io::Result<ExitStatus>,
) -> Result<(), Stopped> {
    let seconds = now().duration_since(start).as_secs_f64();
    let stopped = |what, code| Err(Stopped { step: step.name.clone(), what, code });
    match status {
        Ok(status) if status.success() => {
            println!("   {} took {seconds:.1} s", step.name);
            Ok(())
        }
        Ok(status) => {
            let code = status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
            stopped(format!("failed after {seconds:.1} s ({status})"), code)
        }
        Err(error) => stopped(format!("could not run {}: {error}", step.program), 1),
    }
}

#[expect(clippy::disallowed_methods, reason = "a person wants to know how long a step takes")]
fn now() -> Instant {
    Instant::now()
}

/// The results of all test binaries together.
#[derive(Default, PartialEq, Debug)]
struct TestSum {
    binaries: u32,
    passed: u32,
    failed: u32,
    ignored: u32,
}

impl TestSum {
    /// Counts a line such as `test result: ok. 4 passed; 0 failed; 0 ignored; …`.
    fn add(&mut self, line: &str) {
        let Some(result) = line.strip_prefix("test result: ") else { return };
        self.binaries += 1;
        let counts = result.split_once(". ").map_or(result, |(_, counts)| counts);
        for count in counts.split(';') {
            let Some((number, what)) = count.trim().split_once(' ') else { continue };
            let number = number.parse().unwrap_or(0);
            match what {
                "passed" => self.passed += number,
                "failed" => self.failed += number,
                "ignored" => self.ignored += number,
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_of_all_binaries_add_up() {
        let mut sum = TestSum::default();
        for line in [
            "running 4 tests",
            "test result: ok. 4 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out",
            "test result: FAILED. 16 passed; 2 failed; 0 ignored; 0 measured; finished in 0.36s",
        ] {
            sum.add(line);
        }
        assert_eq!(sum, TestSum { binaries: 2, passed: 20, failed: 2, ignored: 1 });
    }

    #[cfg(unix)]
    #[test]
    fn a_failing_step_passes_its_code_on() {
        let here = Path::new(".");
        let step = Step::new("shell", "a test", "sh").set("CODE", "7").with(&["-c", "exit $CODE"]);
        let stopped = run(here, &step).unwrap_err();
        assert_eq!(stopped.code, 7);
        assert!(stopped.to_string().starts_with("the step shell failed after "), "{stopped}");
        assert!(run(here, &Step::new("true", "a test", "true")).is_ok());
        let absent = run(here, &Step::new("absent", "a test", "no-such-program")).unwrap_err();
        assert!(absent.to_string().contains("could not run no-such-program"), "{absent}");
        let loud = Step::new("loud", "a test", "sh").with(&["-c", "echo why >&2; exit 3"]);
        let (stopped, said) = run_heard(here, &loud).unwrap_err();
        assert_eq!((stopped.code, said.as_str()), (3, "why\n"));
    }
}
