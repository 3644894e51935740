//! Why work with files ended.

/// Why work did nothing or stopped.
#[derive(Debug)]
pub enum Stop {
    /// 2: the input is wrong; nothing was written.
    WrongInput(String),
    /// 1: it failed.
    Failed(String),
}

impl std::fmt::Display for Stop {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (Self::WrongInput(message) | Self::Failed(message)) = self;
        formatter.write_str(message)
    }
}

impl From<taxel::InputError> for Stop {
    fn from(error: taxel::InputError) -> Self {
        Self::WrongInput(error.to_string())
    }
}
