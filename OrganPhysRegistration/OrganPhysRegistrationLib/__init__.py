"""MRML and Qt glue of the OrganPhysRegistration module: nothing here is needed by the core package."""
