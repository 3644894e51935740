//! Requests to stop, heard within steps.

/// What is asked; nothing at first.
#[derive(Default)]
pub(super) struct Ear(Option<Box<dyn Fn() -> bool + Send + Sync>>);

impl Ear {
    pub(super) fn new(asked: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Some(Box::new(asked)))
    }

    pub(super) fn asked(&self) -> bool {
        self.0.as_ref().is_some_and(|asked| asked())
    }
}
