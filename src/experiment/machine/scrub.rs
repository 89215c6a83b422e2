//! Takes absolute paths out of recorded text, since they name users and places.
//!
//! The build script shares this file: a path must not reach the compiled program either.

/// Characters that end a path. A blank does not, because directories may have blanks in their
/// names and half a path would remain.
const ENDS_PATH: &[char] = &['=', ':', ',', ';', '"', '\'', '|', '<', '>', '(', ')', '[', ']', '{', '}'];

/// Replaces each absolute path by its last component, and a home directory, whose last component
/// is a user name, by the word `home`.
pub fn without_paths(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = first_path(rest) {
        let (before, path) = rest.split_at(start);
        let drive = if has_drive(path) { 2 } else { 0 };
        let length = path[drive..].find(ENDS_PATH).map_or(path.len(), |end| drive + end);
        kept.push_str(before);
        kept.push_str(last_component(&path[drive..length]));
        rest = &path[length..];
    }
    kept.push_str(rest);
    kept
}

/// The byte at which the first absolute path begins.
fn first_path(text: &str) -> Option<usize> {
    text.char_indices().map(|(at, _)| at).find(|&at| {
        let (before, here) = text.split_at(at);
        (starts_word(before) && (has_root(here) || has_drive(here)))
            || (follows_flag(before) && has_root(here))
    })
}

fn has_root(text: &str) -> bool {
    let mut letters = text.chars();
    matches!(letters.next(), Some('/' | '\\')) && letters.next().is_some_and(|next| !next.is_whitespace())
}

fn has_drive(text: &str) -> bool {
    let bytes = text.as_bytes();
    bytes.len() > 2 && bytes[0].is_ascii_alphabetic() && bytes[1] == b':' && matches!(bytes[2], b'/' | b'\\')
}

fn starts_word(before: &str) -> bool {
    before
        .chars()
        .next_back()
        .is_none_or(|last| last.is_whitespace() || last == '@' || ENDS_PATH.contains(&last))
}

/// Compilers take a path right after a flag of one letter, as in `-L/lib`.
fn follows_flag(before: &str) -> bool {
    let mut letters = before.char_indices().rev();
    let letter = letters.next().map(|(_, letter)| letter);
    let dash = letters.next();
    letter.is_some_and(|letter| letter.is_ascii_alphabetic())
        && dash.is_some_and(|(at, dash)| dash == '-' && starts_word(&before[..at]))
}

fn last_component(path: &str) -> &str {
    let mut components = path.rsplit(['/', '\\']).filter(|part| !part.is_empty());
    let last = components.next().unwrap_or("");
    match components.next() {
        Some(parent) if ["home", "users"].contains(&parent.to_ascii_lowercase().as_str()) => "home",
        None if last == "root" => "home",
        _ => last,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_paths_keep_only_their_last_component() {
        for (text, expected) in [
            ("-Clinker=/usr/bin/clang", "-Clinker=clang"),
            ("-L/home/ada/lib", "-Llib"),
            ("-L native=/opt/x/lib64", "-L native=lib64"),
            ("-Wl,-rpath,/opt/a:/opt/b", "-Wl,-rpath,a:b"),
            ("--remap-path-prefix=/home/ada/p=/src", "--remap-path-prefix=p=src"),
            (r"-Clinker=C:\Users\ada\bin\lld.exe", "-Clinker=lld.exe"),
            ("/home/ada lovelace/tool", "tool"),
            ("@/opt/x/arguments", "@arguments"),
        ] {
            assert_eq!(without_paths(text), expected);
        }
    }

    #[test]
    fn a_home_directory_loses_its_user_name() {
        for path in ["/home/ada", "/home/ada/", r"C:\Users\ada", "/export/home/ada", "/root"] {
            assert_eq!(without_paths(path), "home");
        }
    }

    #[test]
    fn text_with_harmless_slashes_stays_as_it_is() {
        for text in [
            "Debian GNU/Linux 12 (bookworm)",
            "Ryzen 7 PRO w/ Radeon Graphics",
            "-Ctarget-cpu=native",
            "rustc 1.95.0 (59807616e 2026-04-14)",
            "a / b",
            "/",
            "",
            "é/ü",
        ] {
            assert_eq!(without_paths(text), text);
        }
    }
}
