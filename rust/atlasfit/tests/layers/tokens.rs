//! Rust source as words and signs, without comments, numbers, characters and lifetimes, and without test-only
//! code.
//!
//! In: the text of a file. Out: [`Token`]s with their lines. This is no parser: it knows just enough to
//! follow paths.

/// A word (identifier or keyword), a string with its opening quote, or a sign; `::` is one sign.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    pub text: String,
    /// From 1.
    pub line: usize,
}

impl Token {
    pub fn is_word(&self) -> bool {
        self.text.starts_with(|c: char| c.is_alphabetic() || c == '_')
    }
}

/// The tokens of a file, test-only items left out.
pub fn tokens(source: &str) -> Vec<Token> {
    without_tests(&Reader { chars: source.chars().collect(), at: 0, line: 1 }.all())
}

struct Reader {
    chars: Vec<char>,
    at: usize,
    line: usize,
}

impl Reader {
    fn peek(&self, ahead: usize) -> char {
        self.chars.get(self.at + ahead).copied().unwrap_or('\0')
    }

    fn next(&mut self) -> char {
        let c = self.peek(0);
        self.at += 1;
        self.line += usize::from(c == '\n');
        c
    }

    fn word(&mut self) -> String {
        let mut word = String::new();
        while self.peek(0).is_alphanumeric() || self.peek(0) == '_' {
            word.push(self.next());
        }
        word
    }

    fn all(mut self) -> Vec<Token> {
        let mut out = Vec::new();
        while self.at < self.chars.len() {
            let line = self.line;
            if let Some(text) = self.one() {
                out.push(Token { text, line });
            }
        }
        out
    }

    /// The next token; `None` for what is left out.
    fn one(&mut self) -> Option<String> {
        match (self.peek(0), self.peek(1)) {
            ('/', '/') => {
                while self.at < self.chars.len() && self.peek(0) != '\n' {
                    self.next();
                }
                None
            }
            ('/', '*') => {
                self.block_comment();
                None
            }
            ('"', _) => Some(self.string()),
            ('\'', _) => {
                self.quote();
                None
            }
            (c, _) if c.is_ascii_digit() => {
                self.word();
                None
            }
            (c, _) if c.is_alphabetic() || c == '_' => {
                let word = self.word();
                let hashes = (0..).take_while(|&i| self.peek(i) == '#').count();
                match word.as_str() {
                    "r" | "br" | "cr" if self.peek(hashes) == '"' => {
                        self.at += hashes;
                        Some(self.raw_string(hashes))
                    }
                    "b" | "c" if self.peek(0) == '"' => Some(self.string()),
                    "b" if self.peek(0) == '\'' => {
                        self.quote();
                        None
                    }
                    // A raw identifier.
                    "r" if hashes == 1 => {
                        self.next();
                        Some(self.word())
                    }
                    _ => Some(word),
                }
            }
            (':', ':') => {
                self.at += 2;
                Some("::".to_owned())
            }
            (c, _) => {
                self.next();
                (!c.is_whitespace()).then(|| c.to_string())
            }
        }
    }

    /// Comments nest.
    fn block_comment(&mut self) {
        let mut depth = 0;
        loop {
            match (self.next(), self.peek(0)) {
                ('/', '*') => depth += 1,
                ('*', '/') => depth -= 1,
                ('\0', _) => return,
                _ => continue,
            }
            self.next();
            if depth == 0 {
                return;
            }
        }
    }

    /// A string, with its opening quote.
    fn string(&mut self) -> String {
        let mut text = String::from(self.next());
        while self.at < self.chars.len() {
            match self.next() {
                '\\' => _ = self.next(),
                '"' => break,
                c => text.push(c),
            }
        }
        text
    }

    fn raw_string(&mut self, hashes: usize) -> String {
        let mut text = String::from(self.next());
        while self.at < self.chars.len() {
            let c = self.next();
            if c == '"' && (0..hashes).all(|i| self.peek(i) == '#') {
                self.at += hashes;
                break;
            }
            text.push(c);
        }
        text
    }

    /// A character or a lifetime.
    fn quote(&mut self) {
        self.next();
        if self.peek(0) == '\\' {
            self.at += 2;
        } else if self.peek(1) != '\'' {
            self.word();
            return;
        }
        while self.at < self.chars.len() && self.next() != '\'' {}
    }
}

/// Leaves out every item behind `#[cfg(test)]` or `#[cfg(all(test, ..))]`.
fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let mut out = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        let texts: Vec<&str> = tokens[i..].iter().take(8).map(|t| t.text.as_str()).collect();
        if texts.starts_with(&["#", "[", "cfg", "(", "test"])
            || texts.starts_with(&["#", "[", "cfg", "(", "all", "(", "test"])
        {
            i = end_of_item(tokens, i);
        } else {
            out.push(tokens[i].clone());
            i += 1;
        }
    }
    out
}

/// Where the item with its attributes, which begins at `i`, is over.
fn end_of_item(tokens: &[Token], mut i: usize) -> usize {
    while tokens.get(i).is_some_and(|t| t.text == "#") {
        i = end_of_group(tokens, i + 1);
    }
    let mut ends_at_brace = true;
    while i < tokens.len() {
        match tokens[i].text.as_str() {
            "use" => ends_at_brace = false,
            ";" => return i + 1,
            "{" if ends_at_brace => return end_of_group(tokens, i),
            "{" | "(" | "[" => {
                i = end_of_group(tokens, i);
                continue;
            }
            // The end of what the item stands in.
            "}" | ")" | "]" => return i,
            _ => {}
        }
        i += 1;
    }
    i
}

/// Where the bracketed group that opens at `i` is over.
pub fn end_of_group(tokens: &[Token], mut i: usize) -> usize {
    let mut depth = 0;
    while i < tokens.len() {
        match tokens[i].text.as_str() {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        i += 1;
        if depth == 0 {
            break;
        }
    }
    i
}
